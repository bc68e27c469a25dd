"""`motionlab sample`, `motionlab evaluate`, and training that begins with shipped weights."""

import json
from dataclasses import replace

import any_rig
import pytest
import torch
from glb_reader import Glb

import motionlab
from motionlab import datasets
from motionlab.__main__ import main
from motionlab.encodings import JointAngles
from motionlab.solvers import lock_feet


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_sample_writes_what_the_model_generates(here, shipped, capsys):
    assert main(["sample", str(shipped), "--seconds", "2", "--out", "walk.bvh", "--seed", "4"]) == 0
    assert "walk.bvh: 2.0 s" in capsys.readouterr().out
    model = motionlab.load(shipped)
    with torch.no_grad():
        made = model.generate(
            60, model.starts[0], temperature=0.5, generator=torch.Generator().manual_seed(4)
        )
    expected = model.encoding.to_motion(made[0])
    written = motionlab.read_bvh("walk.bvh")
    assert written.fps == pytest.approx(30, abs=0.01) and len(written) == 60
    torch.testing.assert_close(written.positions(), expected.positions(), rtol=0, atol=1e-4)


def test_sample_options_reach_the_model(here, shipped):
    def sampled(*options):
        assert main(["sample", str(shipped), "--seconds", "1", "--out", "a.bvh", *options]) == 0
        return motionlab.read_bvh("a.bvh").positions()

    usual = sampled()
    assert torch.equal(usual, sampled())
    for options in (["--seed", "1"], ["--temperature", "1"], ["--component-temperature", "3"],
                    ["--noise", "0.5"], ["--memory", "0.9"], ["--start", "2"]):  # fmt: skip
        assert not torch.equal(usual, sampled(*options)), options
    name = motionlab.load(shipped).start_names[2]
    assert torch.equal(sampled("--start", "2"), sampled("--start", name))


def test_sample_with_a_memory_draws_it_and_goes_on_if_it_is_longer(here, shipped):
    def sampled(name, *options):
        more = ["--memory", "0.9", "--out", name, *options]
        assert main(["sample", str(shipped), *more]) == 0
        return motionlab.read_bvh(name).positions()

    short, long = sampled("short.bvh", "--seconds", "1"), sampled("long.bvh", "--seconds", "2")
    torch.testing.assert_close(long[:30], short)
    assert torch.equal(short, sampled("white.bvh", "--seconds", "1", "--memory", "0.9"))
    assert not torch.equal(short, sampled("white.bvh", "--seconds", "1", "--memory", "0"))
    model = motionlab.load(shipped)
    chance, settings = torch.Generator().manual_seed(0), {"temperature": 0.5, "memory": 0.9}
    with torch.no_grad():
        first, state = model.go_on(13, model.starts[0], generator=chance, **settings)
        second, _ = model.go_on(17, state, generator=chance, **settings)
    made = model.encoding.to_motion(torch.cat([first, second], 1)[0])
    torch.testing.assert_close(short, made.positions(), rtol=0, atol=1e-4)


def test_what_a_dancer_has_not_is_said(here, capsys):
    for command in ("sample", "evaluate"):
        out = ["--out", "a.bvh"] if command == "sample" else ["--data", "gaits"]
        for option in ("--memory", "--temperature", "--component-temperature"):
            assert main([command, "aclstm-martial", option, "0.5", *out]) == 1
            said = capsys.readouterr().err
            assert f"{option}: AcLstm has none" in said and "Traceback" not in said
    assert not list(here.iterdir())


@pytest.mark.parametrize("knows_contacts", [True, False])
def test_sample_with_locked_feet(here, shipped, monkeypatch, knows_contacts):
    """Labelled by the network, or by speed where it has no labels."""
    model = motionlab.load(shipped)
    with torch.no_grad():
        chance = torch.Generator().manual_seed(0)
        made = model.generate(60, model.starts[0], temperature=0.5, generator=chance)[0]
    motion = model.encoding.to_motion(made)
    down = motion.contacts if knows_contacts else motionlab.contacts.label(motion)
    if not knows_contacts:
        blind = lambda self, *a, **k: replace(to_motion(self, *a, **k), contacts=None)
        to_motion = JointAngles.to_motion
        monkeypatch.setattr(JointAngles, "to_motion", blind)
    assert main(["sample", str(shipped), "--seconds", "2", "--out", "a.bvh", "--lock-feet"]) == 0
    expected = lock_feet(motion, down, floor=None).positions()
    assert (expected - motion.positions()).abs().max() > 0.01
    written = motionlab.read_bvh("a.bvh").positions()
    torch.testing.assert_close(written, expected, rtol=0, atol=1e-3)


def test_sample_onto_a_rig_and_as_glb(here, shipped, capsys):
    """The rig's joints have axes drawn anyhow; a person stands in its one frame."""
    command = ["sample", str(shipped), "--seconds", "1"]
    model = motionlab.load(shipped)
    with torch.no_grad():
        chance = torch.Generator().manual_seed(0)
        made = model.generate(30, model.starts[0], temperature=0.5, generator=chance)[0]
    motion = model.encoding.to_motion(made)
    taller = replace(motion.skeleton, offsets=1.2 * motion.skeleton.offsets)
    stance = motionlab.Motion(taller, torch.zeros(1, 3), torch.eye(3).repeat(1, 21, 1, 1), 30)
    motionlab.write_bvh(any_rig.drawn(stance, any_rig.random_axes(21, 0)), "rig.bvh", units="m")
    onto = ["--skeleton", "rig.bvh", "--rig-units", "m"]
    assert main([*command, *onto, "--out", "b.bvh"]) == 0
    assert "onto rig, from foot to head 1.34 m and now 1.61 m" in capsys.readouterr().out
    found = motionlab.read_bvh("b.bvh", units="m")  # as the rig is
    assert found.skeleton.matches(motionlab.read_bvh("rig.bvh", units="m").skeleton)
    expected = motion.retarget(taller).positions()
    torch.testing.assert_close(found.positions(), expected, rtol=0, atol=1e-3)
    assert main([*command, *onto, "--out", "b.glb", "--root-motion", "ground"]) == 0
    glb = Glb("b.glb")
    assert glb.worlds(30).shape[0] == 30 and glb.tree["nodes"][-2]["name"] == "Root"
    assert main([*command, "--out", "c.bvh", "--skeleton", "none.bvh"]) == 1
    assert "none.bvh: can't be opened" in capsys.readouterr().err
    assert not (here / "c.bvh").exists()


def test_sample_of_several_characters(here, shipped, capsys):
    main(["sample", str(shipped), "--seconds", "1", "--out", "w.bvh", "--characters", "3"])
    assert sorted(p.name for p in here.iterdir()) == ["w_1.bvh", "w_2.bvh", "w_3.bvh"]
    out = capsys.readouterr().out
    assert all(repr(name) in out for name in motionlab.load(shipped).start_names[:3])
    main(["sample", str(shipped), "--seconds", "1", "--out", "w.bvh", "--characters", "3",
          "--start", "0"])  # fmt: skip
    first, second, _ = (motionlab.read_bvh(f"w_{i}.bvh").positions() for i in (1, 2, 3))
    assert not torch.equal(first, second)  # one start, another chance each


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--seconds", "0"], "above 0"),
        (["--seconds", "-3"], "above 0"),
        (["--seconds", "nan"], "above 0"),
        (["--seconds", "0.01"], "no frame"),
        (["--seconds", "1e300"], "at most"),
        (["--seconds", "inf"], "above 0"),
        (["--characters", "0"], "1 to 1000"),
        (["--temperature", "0"], "temperature is 0.0"),
        (["--component-temperature", "-1"], "component_temperature"),
        (["--temperature", "1e30"], "NaN or infinite"),
        (["--noise", "nan"], "noise is nan"),
        (["--memory", "1"], "memory is 1.0; it must be"),
        (["--memory", "-0.1"], "memory is -0.1; it must be"),
        (["--memory", "nan"], "memory is nan; it must be"),
        (["--seed", "-1"], "from 0 to"),
        (["--seed", str(10**20)], "from 0 to"),
        (["--start", "99"], "there is none"),
        (["--start", ""], "there is none"),
        (["--start", "hop"], "0 "),
        (["--out", "none/w.bvh"], "none: can't be written to"),
        (["--out", "w.fbx"], "FBX is never written"),
    ],
    ids=" ".join,
)
def test_sample_refuses_and_writes_nothing(here, shipped, capsys, options, said):
    arguments = ["--seconds", "1", "--out", "w.bvh"]
    assert main(["sample", str(shipped), *arguments, *options]) == 1
    printed = capsys.readouterr().err
    assert said in printed and "Traceback" not in printed
    assert not list(here.iterdir())


def test_sample_of_weights_that_were_not_shipped(here, trained, capsys):
    command = ["sample", str(trained), "--seconds", "1", "--out", "w.bvh"]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert "from 'mean frame'" in said and "no temperature of their own" in said
    assert len(motionlab.read_bvh("w.bvh")) == 30
    assert main([*command, "--temperature", "0.5"]) == 0
    assert "no temperature" not in capsys.readouterr().out


def test_sample_looks_at_the_output_first(here, shipped, monkeypatch, capsys):
    def never(*arguments, **options):
        raise AssertionError("sampled first")

    monkeypatch.setattr(motionlab.models.LstmGmm, "generate", never)
    (here / "w.bvh").mkdir()
    assert main(["sample", str(shipped), "--out", "w.bvh"]) == 1
    assert main(["sample", str(shipped), "--out", "none/w.bvh"]) == 1
    assert "is a folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    "command", [["sample", "--out", "w.bvh"], ["evaluate"]], ids=lambda c: c[0]
)
def test_weights_that_are_not_there(here, capsys, command):
    name, *rest = command
    assert main([name, "walker", *rest]) == 1
    assert "Weights 'walker'" in capsys.readouterr().err
    (here / "other.safetensors").write_bytes(b"not weights")
    assert main([name, "other.safetensors", *rest]) == 1
    assert "damaged" in capsys.readouterr().err


QUICK = ["--starts", "3", "--seconds", "2"]


def test_evaluate_prints_and_writes(here, shipped, gaits, capsys):
    command = ["evaluate", str(shipped), "--data", str(gaits.path), *QUICK, "--out", "e.json"]
    assert main(command) == 0
    out = capsys.readouterr().out
    assert "nats a frame" in out and "speed (m/s)" in out and "frozen" in out
    found = json.loads((here / "e.json").read_text())
    model = motionlab.load(shipped)
    assert found["weights"] == model.hash and found["data_hash"] == gaits.data.hash
    assert found["sampling"] == {"temperature": 0.5} and found["starts"] == 3
    assert found["log_likelihood"]["value"] == pytest.approx(
        model.about["log_likelihood"]["half"]["value"]
    )
    assert found["data"]["jerk (m/s³)"]["low"] > 0
    for path, said in [("none/e.json", "can't be written to"), (".", "is a folder")]:
        assert main([*command[:-1], path]) == 1
        assert said in capsys.readouterr().err


def test_evaluate_reads_a_folder_as_prepare_does(here, shipped, capsys):
    (here / "mine").mkdir()
    for i in range(10):
        walk = datasets.gaits.make(seconds=2.5, speed=1 + i / 10, seed=i)
        motionlab.write_bvh(walk, here / "mine" / f"{i}.bvh", units="m", up="z")
    command = ["evaluate", str(shipped), "--data", "mine", *QUICK]
    assert main([*command, "--units", "m", "--up", "z"]) == 0
    assert "nats a frame" in capsys.readouterr().out
    assert main([*command[:2], "--data", "gaits", "--up", "z"]) == 1
    assert "how its files are read is known; leave out up" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--starts", "0"], "1 or more"),
        (["--seconds", "nan"], "1 or more"),
        (["--seconds", "1e12"], "no more"),
        (["--temperature", "0"], "temperature"),
        (["--seed", str(2**32)], "from 0 to"),
        (["--data", "none.npz"], "no such file"),
    ],
    ids=" ".join,
)
def test_evaluate_refuses(here, shipped, gaits, capsys, options, said):
    arguments = ["--data", str(gaits.path), *QUICK, "--out", "e.json", *options]
    assert main(["evaluate", str(shipped), *arguments]) == 1
    assert said in capsys.readouterr().err
    assert not list(here.iterdir())


def test_training_begins_with_a_shipped_name(here, shipped, gaits, monkeypatch):
    monkeypatch.setattr(motionlab.weights, "_FOLDER", shipped.parent)
    command = ["train", "lstm-gmm-contacts", "--preset", "smoke", "--data", str(gaits.path),
               "--accelerator", "cpu", "--updates", "1", "--from", "tiny", "--out", "tuned",
               "--learning-rate", "1e-12"]  # fmt: skip
    assert main(command) == 0
    tuned, tiny = (motionlab.load(x) for x in ("tuned/best.safetensors", "tiny"))
    for mine, its in zip(tuned.parameters(), tiny.parameters(), strict=True):
        torch.testing.assert_close(mine, its)
