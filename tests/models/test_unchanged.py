"""What was made of weights is made again when they change, and only then."""

import copy
import gc
import weakref

import pytest
import torch
from torch import nn

from motionlab.models.unchanged import made_of


@pytest.fixture
def model():
    torch.manual_seed(0)
    return nn.Sequential(nn.Linear(3, 2), nn.BatchNorm1d(2))


def total(model):
    return sum(float(tensor.detach().sum()) for tensor in model.state_dict().values())


def changed_in_place(model):
    with torch.no_grad():
        model[0].weight.add_(1)


def trained(model):
    model.train()(torch.randn(5, 3)).square().sum().backward()
    torch.optim.SGD(model.parameters(), lr=0.1).step()


CHANGES = {
    "in place": changed_in_place,
    "by an optimiser": trained,
    "loaded": lambda m: m.load_state_dict({k: v + 1 for k, v in m.state_dict().items()}),
    "another module": lambda m: setattr(m, "0", nn.Linear(3, 2)),
    "another parameter": lambda m: setattr(m[0], "bias", nn.Parameter(torch.ones(2))),
    "another tensor": lambda m: setattr(m[0].weight, "data", torch.ones(2, 3)),
    "a buffer": lambda m: setattr(m[1], "running_mean", torch.ones(2)),
    "another type": lambda m: m.half(),
}


@pytest.mark.parametrize("change", CHANGES)
def test_changes_are_seen(model, change):
    made = lambda: made_of(model, "total", lambda: total(model))
    before = made()
    CHANGES[change](model)
    assert made() == total(model) != before


def test_what_is_unchanged_is_not_made_again(model):
    first = made_of(model, "it", object)
    assert made_of(model, "it", object) is first
    model.eval().requires_grad_(False)
    model(torch.randn(5, 3))
    assert made_of(model, "it", object) is first
    assert made_of(model, "other", object) is not first
    assert made_of(copy.deepcopy(model), "it", object) is not first


def test_changes_of_weights_made_in_inference_mode_leave_no_trace(model):
    with torch.inference_mode():
        made = copy.deepcopy(model)
        assert made_of(made, "it", object) is not made_of(made, "it", object)


def test_it_lives_no_longer_than_its_model():
    model = nn.Linear(2, 2)
    of_weights = weakref.ref(made_of(model, "it", lambda: torch.zeros(1)))
    assert of_weights() is not None
    del model
    gc.collect()
    assert of_weights() is None
