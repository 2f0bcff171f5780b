"""A small part of the fuzz, with a seed of its own."""

import pytest

from tests.fuzz import fuzz
from tests.fuzz_api import API
from tests.fuzz_cli import COMMANDS


@pytest.mark.parametrize("seed", [1, 2])
def test_everything_is_an_answer_or_a_refusal(seed):
    outcomes, failures = fuzz(range(150), seed)
    assert failures == {}
    assert sum(outcomes.values()) == 150


def test_the_same_seed_is_the_same_cases():
    assert fuzz(range(40), 5)[0] == fuzz(range(40), 5)[0]


def test_a_failure_is_one(monkeypatch):
    def broken(case):
        raise KeyError("lost")

    monkeypatch.setattr(API, "run", broken)
    outcomes, failures = fuzz(range(20), 1)
    assert sum(map(len, failures.values())) > 5
    assert all("KeyError" in failure for failure in failures)
    assert sum(outcomes.values()) == 20


def test_the_commands_are_those_that_end_soon():
    assert {"convert", "fit", "furnace", "fresnel", "texture", "mtl", "gltf"} <= set(COMMANDS)
