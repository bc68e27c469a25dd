"""STRNN: in which order it says frames, what it hears, what it learns through, bad input."""

import copy

import pytest
import torch

from motionlab import Skeleton
from motionlab.datasets import gaits
from motionlab.encodings import BodyFrame, JointAngles, Normalizer
from motionlab.errors import ModelError
from motionlab.models import Strnn
from motionlab.models.strnn import ALONE, BEHIND, FIRST
from motionlab.training.checkpoints import load_weights, save_weights

KINDS = {
    "temporal": {"spatial": False, "residual": False},
    "spatiotemp": {"residual": False},
    "composite": {},
}
LENGTHS = ((39, 1), (35, 5), (30, 10), (20, 20), (10, 10), (5, 5))


@pytest.fixture(scope="module")
def clips():
    motions = [gaits.make(seconds=1.5, speed=1 + 0.2 * i, seed=i) for i in range(6)]
    encoding = BodyFrame(motions[0].skeleton, motions[0].fps)
    return encoding, torch.stack([encoding.encode(motion)[:40] for motion in motions]).double()


def made(clips, kind="composite", width=16, encode=4, predict=3, **settings) -> Strnn:
    encoding, features = clips
    torch.manual_seed(0)
    normalizer = Normalizer.fit(list(features.float()))
    model = Strnn(encoding, normalizer, width, encode, predict, **KINDS[kind] | settings)
    if model.residual:  # it begins as nothing
        torch.nn.init.normal_(model.filter[-1].weight, std=0.1)
    return model.double()


def by_hand(model: Strnn, read: torch.Tensor, true: torch.Tensor | None = None) -> torch.Tensor:
    """What a network without a spatial one says of read (batch, encode, kept): cells in a loop, as the
    paper tells it. true : what is heard, (batch, encode + predict, kept)."""
    width, cell = model.width, torch.nn.functional

    def stepped(x, h, c, of_x, of_h, bias):
        enter, keep, new, show = (cell.linear(x, of_x) + cell.linear(h, of_h) + bias).chunk(4, -1)
        c = keep.sigmoid() * c + enter.sigmoid() * new.tanh()
        return show.sigmoid() * c.tanh(), c

    h = c = read.new_zeros(len(read), width)
    its = model.encoder
    for t in range(model.encode):
        h, c = stepped(read[:, t], h, c, its.weight_ih_l0, its.weight_hh_l0,
                       its.bias_ih_l0 + its.bias_hh_l0)  # fmt: skip
    said = {}
    for part, order in (
        (model.decoder, range(model.encode)[:: -1 if model.backward else 1]),
        (model.predictor, range(model.encode, model.frames)),
    ):
        own_h, own_c, heard = h, c, model.leave(h)
        for t in order:
            own_h, own_c = stepped(heard, own_h, own_c, part.heard.weight, part.own.weight,
                                   part.heard.bias)  # fmt: skip
            said[t] = model.leave(own_h)
            heard = said[t] if true is None else true[:, t]
    return torch.stack([said[t] for t in range(model.frames)], 1)


@pytest.mark.parametrize("conditional", [True, False])
@pytest.mark.parametrize("backward", [True, False])
def test_it_says_what_a_loop_of_cells_says(clips, conditional, backward):
    model = made(clips, "temporal", conditional=conditional, backward=backward)
    true = model.normalizer(clips[1][:, :7])
    found, _ = model._said(true[:, :4], None if conditional else true)
    torch.testing.assert_close(found, by_hand(model, true[:, :4], None if conditional else true))


def test_the_decoder_begins_with_the_last_frame(clips):
    model = made(clips, "temporal")
    read = model.normalizer(clips[1][:, :4])
    before, _ = model._said(read)
    with torch.no_grad():  # deaf to itself, its first word is as it was and the others are not
        model.decoder.heard.weight.zero_()
        model.decoder.own.weight[model.width :].mul_(0.5)
    after, _ = model._said(read)
    changed = (after - before).abs().amax((0, 2))
    assert (changed[:4] > 1e-6).all() and (changed[4:] == 0).all()  # the predictor is another


def test_decoder_and_predictor_begin_where_the_encoder_ends(clips):
    model = made(clips, "temporal")
    model.predictor.load_state_dict(model.decoder.state_dict())
    said, _ = model._said(model.normalizer(clips[1][:, :4]))
    torch.testing.assert_close(said[:, :4].flip(1)[:, :3], said[:, 4:])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("conditional", [True, False])
def test_the_future_does_not_leak(clips, kind, conditional):
    model = made(clips, kind, conditional=conditional).eval()
    true = model.normalizer(clips[1][:, :7]).requires_grad_()
    said, _ = model._said(true[:, :4], None if conditional else true)
    for t in range(7):
        (slope,) = torch.autograd.grad(said[:, t].sum(), true, retain_graph=True)
        felt = slope.abs().amax((0, 2)) > 0
        assert felt[:4].all()  # the encoder has read all of them
        assert not felt[max(4, t) :].any()
        assert felt[4:t].all() == (not conditional or t <= 4)


def test_training_asks_for_both_means(clips):
    model = made(clips)
    windows = clips[1][:, :7]
    said = model.normalizer(model(windows[:, :4]))
    off = (said - model.normalizer(windows)).square()
    wanted = off[:, :4].mean() + off[:, 4:].mean()
    torch.testing.assert_close(model.loss(windows), wanted)


def test_second_differences_cost_across_the_seam_but_not_in_contacts(clips):
    model, windows = made(clips, "temporal"), clips[1][:, :7]
    plain = model.loss(windows)
    model.smooth = 0.5
    said, _ = model._said(model.normalizer(windows)[:, :4])
    bends = said[..., :-4].diff(n=2, dim=1).square().mean()
    torch.testing.assert_close(model.loss(windows) - plain, 0.5 * bends)
    torch.testing.assert_close(model.eval().loss(windows), plain)
    assert model.encoding.feature_names[-4:] == tuple(
        model.encoding.feature_names[i] for i in model.normalizer.kept[~model.glides].tolist()
    )


def test_bones_of_wrong_lengths_cost_in_all_stages_but_not_at_run_time(clips):
    encoding, features = clips
    assert encoding.bones_off(features).abs().max() < 1e-6  # real frames have the skeleton's bones
    model = made(clips, "temporal", residual=True)  # nothing is dropped, no batch norm
    windows = features[:, :7]
    for stage in (None, *(torch.full((6,), stage) for stage in (FIRST, BEHIND))):
        model.bones = 0.0
        plain = model.loss(windows, stage=stage)
        seen = model.normalizer(windows)[:, :4]
        said = model._whole(seen) if stage is None or stage[0] == BEHIND else model._said(seen)[0]
        points = encoding.positions(model.normalizer.inverse(said))
        skeleton, parents = encoding.skeleton, list(encoding.skeleton.parents[1:])
        lengths = (points[:, :, 1:] - points[:, :, parents]).norm(dim=-1)
        off = 100 * (lengths - skeleton.offsets[1:].norm(dim=-1))
        model.bones = 0.2
        torch.testing.assert_close(
            model.loss(windows, stage=stage) - plain,
            0.2 * off.square().mean(),
            rtol=1e-4,
            atol=1e-7,
        )
    plain = model.eval().loss(windows)
    model.bones = 0.0
    torch.testing.assert_close(model.loss(windows), plain)


def test_the_cost_of_bones_is_kept_with_the_weights(clips):
    model = made(clips, bones=0.1)
    assert Strnn.from_config(model.config()).bones == 0.1
    assert "bones" not in made(clips).config()  # as older weights are


def test_the_penalty_is_of_weights_and_codes(clips):
    model, windows = made(clips, "temporal", penalty=0.1), clips[1][:, :7]
    _, codes = model._said(model.normalizer(windows)[:, :4])
    weights = torch.cat([p.flatten() for p in model.parameters()])
    wanted = 0.1 * (weights.square().mean() + codes.square().mean())
    torch.testing.assert_close(model.loss(windows) - model.eval().loss(windows), wanted)


def test_noise_disturbs_what_is_read_and_not_what_is_asked_for(clips):
    model, windows = made(clips, "temporal"), clips[1][:, :7]
    noise = torch.randn(windows.shape, generator=torch.Generator().manual_seed(0)).double()
    ahead = noise.clone()
    ahead[:, :4] = 0
    assert model.loss(windows, noise) != model.loss(windows)
    assert model.loss(windows, ahead) == model.loss(windows)


def test_stages_teach_what_they_name(clips):
    model, windows = made(clips), clips[1][:, :7]
    residual = {name for name, _ in model.named_parameters() if name.startswith("filter")}
    others = {name for name, _ in model.named_parameters()} - residual
    noise = torch.full_like(windows, 0.1)
    statistics = {name: part.clone() for name, part in model.named_buffers()}
    for stage, learns in ((ALONE, residual), (BEHIND, residual), (FIRST, others)):
        model.zero_grad()
        model.loss(windows, noise, torch.arange(6), torch.full((6,), stage)).backward()
        assert {n for n, p in model.named_parameters() if p.grad is not None} == learns
        same = all(torch.equal(part, statistics[name]) for name, part in model.named_buffers())
        assert same == (stage != FIRST) and model.training


def test_what_is_dropped_hangs_on_the_lots_alone(clips):
    model, windows = made(clips, drop=0.5), clips[1][:, :7]
    losses = [model.loss(windows, lots=torch.full((6,), lot)) for lot in (1, 1, 2)]
    assert losses[0] == losses[1] != losses[2]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("encode", "predict"), LENGTHS)
def test_all_lengths_go_on(clips, kind, encode, predict):
    model = made(clips, kind, 8, encode, predict)
    windows = clips[1][:, : encode + predict]
    assert model.loss(windows).isfinite()
    before = copy.deepcopy(model.state_dict())
    found = model.extrapolate(windows, 23)
    assert found.shape == (6, 23, 73)
    seen = windows[:, -encode:]
    with torch.no_grad():
        model.eval()
        first = model(seen)[:, encode:]
        torch.testing.assert_close(found[:, :predict], first[:, :23])
        second = model(torch.cat([seen, first], 1)[:, -encode:])[:, encode:]
        torch.testing.assert_close(found[:, predict : 2 * predict], second[:, : 23 - predict])
    assert all(torch.equal(part, before[name]) for name, part in model.state_dict().items())


def test_at_run_time_a_motion_does_not_depend_on_those_beside_it(clips):
    model, windows = made(clips, drop=0.5), clips[1][:, :7]
    for call in (lambda x: model.extrapolate(x, 5), model.reconstruct, model.project):
        torch.testing.assert_close(call(windows)[2], call(windows[2]))
    assert model.training


def test_weights_that_are_kept_at_run_time_are_those_of_now(clips):
    model, windows = made(clips, "temporal"), clips[1]
    with torch.no_grad():
        before = model.extrapolate(windows, 5)
        assert torch.equal(model.extrapolate(windows, 5), before)
        model.leave.weight.mul_(0.9)
        after = model.extrapolate(windows, 5)
    assert not torch.equal(after, before)
    torch.testing.assert_close(after, model.extrapolate(windows, 5))  # with a gradient: made anew


def test_noise_at_run_time_has_a_source(clips):
    model, windows = made(clips, "temporal"), clips[1]
    go = lambda seed: model.extrapolate(
        windows, 9, noise=0.1, generator=torch.Generator().manual_seed(seed)
    )
    assert torch.equal(go(1), go(1)) and not torch.equal(go(1), go(2))


@torch.no_grad()
@pytest.mark.parametrize("kind", ["temporal", "composite"])
def test_a_faded_seam_goes_on_where_the_last_window_was_going(clips, kind):
    model = made(clips, kind, encode=6, predict=8)
    seen = clips[1][:3]
    plain, faded = model.extrapolate(seen, 30), model.extrapolate(seen, 30, fade=5)
    glides = model.normalizer.kept[model.glides]
    before, whole = (torch.cat([seen, some], 1)[..., glides] for some in (plain, faded))
    bend = lambda some, t: float((some[:, t] - 2 * some[:, t - 1] + some[:, t - 2]).abs().max())
    left = (torch.arange(5, 0, -1) / 5).square()[:, None]
    for begin in (40, 48, 56):  # the first seam is that to the frames that were read
        assert bend(whole, begin) < 1e-8 < 1e-3 < bend(before, begin)
        off = before[:, begin : begin + 8] - whole[:, begin : begin + 8]
        assert torch.allclose(off[:, :5], left * off[:, :1])
        assert torch.allclose(off[:, 5:], torch.zeros(()).double())
    rest = [i for i in range(faded.shape[-1]) if i not in glides.tolist()]
    assert torch.equal(faded[..., rest], plain[..., rest])  # contacts are or are not
    assert torch.equal(model.extrapolate(seen, 30, fade=0), plain)
    assert torch.allclose(model.extrapolate(seen, 12, fade=5), faded[:, :12])
    for fade in (8, -1, 2.5):
        with pytest.raises(ModelError, match="give 0 to 7"):
            model.extrapolate(seen, 5, fade=fade)


def test_frames_are_said_again_window_by_window(clips):
    model, features = made(clips).eval(), clips[1][:, :10]
    found = model.reconstruct(features)
    assert found.shape == features.shape
    first, second, last = (model(features[:, i : i + 4])[:, :4] for i in (0, 4, 6))
    both = (second[:, 2:] + last[:, :2]) / 2
    wanted = torch.cat([first, second[:, :2], both, last[:, 2:]], 1)
    torch.testing.assert_close(found, wanted)


def test_a_projection_is_the_mean_of_all_that_is_said(clips):
    model, features = made(clips).eval(), clips[1][:, :6]
    said = torch.full((3, 6, 6, 73), torch.nan).double()
    for begin in range(3):
        said[begin, :, begin : begin + 4] = model(features[:, begin : begin + 4])[:, :4]
    torch.testing.assert_close(model.project(features, step=1), said.nanmean(0))


@pytest.mark.parametrize("backward", [True, False])
def test_what_was_learned_travels(clips, tmp_path, backward):
    model = made(clips, backward=backward).float()
    save_weights(tmp_path / "some.safetensors", model, {})
    again, _ = load_weights(tmp_path / "some.safetensors")
    features = clips[1].float()
    assert torch.equal(again.extrapolate(features, 5), model.extrapolate(features, 5))
    assert torch.equal(again.reconstruct(features), model.reconstruct(features))


@pytest.mark.parametrize("what", ["extrapolate", "reconstruct", "project"])
def test_frames_that_can_not_be_read(clips, what):
    model, features = made(clips), clips[1]
    call = getattr(model, what)
    more = (3,) if what == "extrapolate" else ()
    with pytest.raises(ModelError, match="3 frames; this network reads 4"):
        call(features[:, :3], *more)
    with pytest.raises(ModelError, match="shape"):
        call(features[..., :60], *more)  # of another skeleton
    with pytest.raises(ModelError, match="NaN"):
        call(torch.full_like(features, torch.nan), *more)


def test_numbers_that_make_no_sense(clips):
    model, features = made(clips), clips[1]
    for n in (0, -1, 2.5, None):
        with pytest.raises(ModelError, match="1 or more"):
            model.extrapolate(features, n)
    for step in (0, 5, 1.5):
        with pytest.raises(ModelError, match="step"):
            model.project(features, step)
    with pytest.raises(ModelError, match="noise"):
        model.extrapolate(features, 3, noise=-1)
    with pytest.raises(ModelError, match="learns from 7"):
        model.loss(features)
    with pytest.raises(ModelError, match="reads 4"):
        model(features)
    for wrong in ({"width": 12}, {"width": 0}, {"encode": 0}, {"predict": 1.5}, {"drop": 1},
                  {"smooth": -1}, {"penalty": float("inf")}, {"bones": -1}):  # fmt: skip
        with pytest.raises(ModelError, match=next(iter(wrong))):
            made(clips, **wrong)


def test_another_encoding_or_normalizer(clips):
    angles = JointAngles(Skeleton.canonical())
    with pytest.raises(ModelError, match="BodyFrame"):
        Strnn(angles, Normalizer(angles.dim))
    with pytest.raises(ModelError, match="normalizer"):
        Strnn(clips[0], Normalizer(9))


@pytest.mark.parametrize("kind", ["temporal", "composite"])
def test_what_is_said_of_a_code_is_what_is_said_of_its_frames(clips, kind):
    model, rows = made(clips, kind).eval(), clips[1][:3, :9]
    code = model.code(rows)
    assert code.shape == (3, 2 * model.width)
    assert torch.allclose(model.say(code), model(rows[:, -4:]))
    assert torch.allclose(model.say(model.code(rows[1])), model(rows[:, -4:])[1])
    with pytest.raises(ModelError, match="say"):
        model.say(code[:, 1:])
    with pytest.raises(ModelError, match="say"):
        model.say(code * torch.nan)


def test_layers_that_know_no_parts(clips):
    dense, tree = made(clips, "spatiotemp", spatial="dense"), made(clips, "spatiotemp")
    shapes = lambda model: {name: its.shape for name, its in model.named_parameters()}
    assert shapes(dense) == shapes(tree), "of the same sizes"
    masks = [its for name, its in dense.named_buffers() if name.endswith("mask")]
    assert masks and all(bool(mask.bool().all()) for mask in masks)
    assert dense(clips[1][:, :4]).isfinite().all()
    with pytest.raises(ModelError, match="spatial"):
        made(clips, spatial="flat")
