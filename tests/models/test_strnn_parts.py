"""The body as a tree: which part sees which, on any skeleton whose limbs are known."""

from dataclasses import replace

import pytest
import torch

from motionlab import Skeleton
from motionlab.encodings import BodyFrame, JointAngles
from motionlab.errors import ModelError
from motionlab.models.strnn_parts import (
    BODY,
    LIMBS,
    SpatialDecoder,
    SpatialEncoder,
    part_channels,
)

WIDTH = 32


@pytest.fixture(scope="module")
def parts():
    encoding = BodyFrame(Skeleton.canonical())
    return part_channels(encoding, range(encoding.dim))


def test_every_channel_belongs_to_one_part(parts):
    names = BodyFrame(Skeleton.canonical()).feature_names
    assert sorted(c for some in parts.values() for c in some) == list(range(73))
    joints = {part: {names[c].rpartition("_")[0] for c in some} for part, some in parts.items()}
    assert joints["left_arm"] == {"LeftShoulder", "LeftUpperArm", "LeftLowerArm", "LeftHand"}
    assert joints["right_leg"] == {"RightUpperLeg", "RightLowerLeg", "RightFoot", "RightToes"}
    assert joints["spine"] == {"Spine", "Chest", "Neck", "Head"}
    assert [names[c] for c in parts["contacts"]] == [*names[-4:]]
    assert len(parts["root"]) == 9


def test_dropped_channels_belong_to_none():
    encoding = BodyFrame(Skeleton.canonical())
    kept = [c for c in range(73) if c not in (60, 62, 64)]
    found = part_channels(encoding, kept)
    assert sorted(c for some in found.values() for c in some) == list(range(70))
    assert len(found["root"]) == 6


def test_without_collar_bones_an_arm_begins_with_the_upper_arm():
    body = Skeleton.canonical()
    said = {f"{side}_shoulder": "" for side in ("left", "right")}
    encoding = BodyFrame(replace(body, roles=said))
    assert len(part_channels(encoding, range(73))["left_arm"]) == 9  # the collar is the spine's


@pytest.mark.parametrize("role", ["left_upper_leg", "right_upper_arm"])
def test_a_skeleton_without_a_limb(role):
    gone = {role: ""} | ({"right_shoulder": ""} if "arm" in role else {})
    encoding = BodyFrame(replace(Skeleton.canonical(), roles=gone))
    with pytest.raises(ModelError, match=role.replace("_", " ")):
        part_channels(encoding, range(73))


def test_a_part_that_does_not_move():
    encoding = BodyFrame(Skeleton.canonical())
    kept = [c for c, name in enumerate(encoding.feature_names) if "LeftHand" not in name]
    assert part_channels(encoding, kept)
    kept = [c for c in kept if not encoding.feature_names[c].startswith("Left")]
    with pytest.raises(ModelError, match="left arm"):
        part_channels(encoding, kept)
    with pytest.raises(ModelError, match="BodyFrame"):
        part_channels(JointAngles(Skeleton.canonical()), range(9))


def test_without_contacts_there_are_six_parts():
    encoding = BodyFrame(Skeleton.canonical(), contacts=False)
    found = part_channels(encoding, range(encoding.dim))
    assert [*found] == [*BODY, "root"]
    frames = torch.randn(5, encoding.dim)
    code = SpatialEncoder(found, WIDTH, 0.0)(frames)
    assert SpatialDecoder(found, WIDTH, 0.0)(code).shape == frames.shape


def felt(layer, rows: int, outputs: slice) -> torch.Tensor:
    """Which inputs of a layer some of its outputs depend on."""
    x = torch.randn(rows, layer.grouped.weight.shape[1], requires_grad=True)
    layer(x)[:, outputs].square().sum().backward()
    return x.grad.abs().sum(0) > 0


def test_a_part_reaches_only_up_its_path(parts):
    torch.manual_seed(0)
    encoder = SpatialEncoder(parts, WIDTH, 0.0)
    encoder.eval()
    sizes, unit = [len(some) for some in parts.values()], WIDTH // 8
    ends = torch.tensor(sizes).cumsum(0).tolist()
    for i, (end, size) in enumerate(zip(ends, sizes, strict=True)):
        seen = felt(encoder.parts, 3, slice(i * unit, (i + 1) * unit))
        assert seen.nonzero()[:, 0].tolist() == [*range(end - size, end)]
    for i in range(len(LIMBS)):
        seen = felt(encoder.limbs, 3, slice(2 * i * unit, 2 * (i + 1) * unit))
        assert seen.view(-1, unit).any(1).nonzero()[:, 0].tolist() == [0, i + 1]  # and the spine
    for i in range(2):
        seen = felt(encoder.halves, 3, slice(4 * i * unit, 4 * (i + 1) * unit))
        assert seen.view(4, -1).any(1).nonzero()[:, 0].tolist() == [2 * i, 2 * i + 1]
    assert felt(encoder.whole, 3, slice(None)).all()


def test_weights_off_the_path_stay_nothing(parts):
    torch.manual_seed(0)
    encoder, decoder = SpatialEncoder(parts, WIDTH, 0.1), SpatialDecoder(parts, WIDTH, 0.1)
    both = torch.nn.ModuleList([encoder, decoder])
    optimizer = torch.optim.Adam(both.parameters())
    frames = torch.randn(9, 73)
    decoder(encoder(frames)).sub(frames).square().mean().backward()
    optimizer.step()
    for module in both.modules():
        if hasattr(module, "mask"):
            assert not module.weight[~module.mask].any()
            assert module.weight.grad[module.mask].any()


def test_a_limb_is_said_by_its_own_half(parts):
    torch.manual_seed(0)
    decoder = SpatialDecoder(parts, WIDTH, 0.0).eval()
    halves = torch.randn(3, 2 * WIDTH // 2, requires_grad=True)
    said = decoder.parts(decoder.limbs(halves))
    frames = decoder.leave(torch.cat([said, torch.zeros(3, 2 * WIDTH // 8)], 1))[:, decoder.order]
    for part, sees in {"left_arm": [0], "right_leg": [1], "spine": [0, 1], "root": []}.items():
        (slope,) = torch.autograd.grad(
            frames[:, parts[part]].sum(), halves, retain_graph=True, allow_unused=True
        )
        found = slope.view(3, 2, -1).abs().sum((0, 2)).nonzero()[:, 0].tolist()
        assert found == sees


def test_encoder_and_decoder_mirror_each_other(parts):
    encoder, decoder = SpatialEncoder(parts, WIDTH, 0.0), SpatialDecoder(parts, WIDTH, 0.0)
    shapes = lambda layer: tuple(layer.grouped.weight.shape)
    assert shapes(encoder.whole) == shapes(decoder.whole)[::-1]
    assert shapes(encoder.halves) == shapes(decoder.limbs)[::-1]
    frames = torch.randn(2, 5, 73)
    assert decoder(encoder(frames)).shape == frames.shape
    # the order of channels is undone: each is said by its own part
    assert torch.equal(frames[..., encoder.order][..., decoder.order], frames)
