"""Results made up for the rules of W3, W4 and W11: each can say yes, and no."""


def refined(skate=0.4, jerk=0.4, critic=0.7, moved=1.0, gain=-1.0, f1=0.95, contact_critic=0.7):
    """Both gaits alike, but for running's foot skate if there are two."""
    skates = skate if isinstance(skate, tuple) else (skate, skate)
    gaits = {}
    for gait, its in zip(("walk", "run"), skates, strict=True):
        near = {"foot skate (cm/s)": {"value": its}, "jerk (m/s³)": {"value": jerk}}
        gaits[gait] = {
            "variants": {
                "RNN": {"critic": {"value": 0.9}},
                "GAN1": {
                    "critic": {"value": critic}, "distance from real over RNN's": near,
                    "root moved (cm)": [{"50%": 0.5}, {"50%": moved}],
                },
                "GAN2": {"critic": {"value": contact_critic}, "labels": {"F1": f1}},
            },
            "GAN2's distance from real minus GAN1's": {
                "foot skate (cm/s)": {"value": gain, "low": gain - 0.5, "high": gain + 0.5}
            },
        }  # fmt: skip
    return {"gaits": gaits}


def styles(accuracy=0.8, one=1.5, each=(2.5, 2.5)):
    told = {"accuracy": accuracy, "effective styles of one": one}
    starts = {str(i): {"effective styles": value} for i, value in enumerate(each)}
    return {"classifier": {"test": told}, "ways": {"as it ships": starts}}


CASES = [
    ("W11", "reproduced", styles()),
    ("W11", "partly", styles(each=(1.0, 2.5))),
    ("W11", "partly", styles(one=2.0, each=(2.5, 3.0))),
    ("W11", "not reproduced", styles(each=(1.9, 1.2))),
    ("W11", "not testable here", styles(accuracy=0.59)),
    ("W3", "reproduced", refined(skate=0.5, jerk=0.5, critic=0.76)),
    ("W3", "partly", refined(critic=0.78)),
    ("W3", "partly", refined(jerk=0.6)),
    ("W3", "partly", refined(skate=(0.4, 0.6))),
    ("W3", "partly", refined(moved=6.0)),
    ("W3", "not reproduced", refined(skate=(0.4, 0.6), jerk=0.6)),
    ("W4", "reproduced", refined()),
    ("W4", "partly", refined(f1=0.8)),
    ("W4", "partly", refined(gain=0.1)),
    ("W4", "partly", refined(contact_critic=0.71)),
    ("W4", "not reproduced", refined(gain=-0.4, f1=0.8)),
]
