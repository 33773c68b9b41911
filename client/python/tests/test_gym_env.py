"""The environment for Gymnasium on a real server: its checker, exact resets, and a task that can be done or missed."""

from __future__ import annotations

import subprocess
import sys
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import nappe

WHY = "Gymnasium is not installed, which nappe.examples.gym_env needs alone"
NO_GYMNASIUM = "import sys; sys.modules['gymnasium'] = None; import nappe.examples.gym_env"


def test_without_gymnasium_it_says_what_to_install() -> None:
    done = subprocess.run([sys.executable, "-c", NO_GYMNASIUM], capture_output=True, text=True)
    assert done.stderr.splitlines()[-1] == (
        "ImportError: nappe.examples.gym_env needs Gymnasium: pip install gymnasium"
    )


@pytest.fixture
def gym_env() -> Any:
    pytest.importorskip("gymnasium", reason=WHY)
    from nappe.examples import gym_env

    return gym_env


@pytest.fixture
def environment(gym_env: Any, server: nappe.Server) -> Iterator[Any]:
    made = gym_env.HangingSheet(server)
    yield made
    made.close()


def run(environment: Any, seed: int, actions: Any) -> list[Any]:
    """All that an episode answers: observations, rewards, ends."""
    told = [environment.reset(seed=seed)[0]]
    for action in actions:
        told += environment.step(action)[:4]
    return told


def same(one: list[Any], other: list[Any]) -> bool:
    return len(one) == len(other) and all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_the_checker_of_gymnasium_has_nothing_to_say(environment: Any) -> None:
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings(record=True) as met:
        warnings.simplefilter("always")
        check_env(environment)
    # Positions in an open space have no bounds; without a spec, since it was not made by `gymnasium.make`.
    allowed = ("minimum value is -infinity", "maximum value is infinity", "spec")
    assert [str(warning.message) for warning in met if not any(word in str(warning.message) for word in allowed)] == []


def test_a_reset_is_exact_and_a_seed_gives_the_target(environment: Any, gym_env: Any, server: nappe.Server) -> None:
    actions = np.random.default_rng(3).uniform(-1, 1, (30, 3)).astype(np.float32)
    first = run(environment, 7, actions)
    run(environment, 8, actions[::-1])
    assert same(first, run(environment, 7, actions))
    assert not same(first, run(environment, 8, actions))
    another = gym_env.HangingSheet(server)
    assert same(first, run(another, 7, actions))
    another.close()


def test_the_task_is_done_by_its_controller_and_not_by_itself(gym_env: Any, server: nappe.Server) -> None:
    import gymnasium

    environment: Any = gymnasium.make("nappe/HangingSheet-v0", server=server)
    for seed in range(6):
        observation, _ = environment.reset(seed=seed)
        reached = late = False
        while not (reached or late):
            observation, reward, reached, late, told = environment.step(gym_env.controller(observation))
        assert reached and told["distance"] == -reward < 0.02
        np.testing.assert_allclose(np.linalg.norm(observation[:3]), told["distance"], rtol=1e-5)
    environment.reset(seed=0)
    ends = [environment.step(np.zeros(3, np.float32))[2:4] for _ in range(200)]
    assert ends == [(False, False)] * 199 + [(False, True)]
    environment.close()


def test_pins_move_as_fast_as_they_are_told_and_no_faster(environment: Any) -> None:
    environment.reset(seed=1)
    full = environment.step(np.array([1, 0, -0.5], np.float32))[0]
    np.testing.assert_allclose(full[6:], [0.02, 0, -0.01], atol=1e-6)
    beyond = environment.step(np.array([9, 0, 0], np.float32))[0]
    np.testing.assert_allclose(beyond[6:], [0.04, 0, -0.01], atol=1e-6)
    with pytest.raises(nappe.Refused, match="nan"):
        environment.step(np.full(3, np.nan, np.float32))


def test_several_share_a_server_and_leave_nothing(gym_env: Any) -> None:
    import gymnasium

    with nappe.serve() as server:
        several = gymnasium.vector.SyncVectorEnv([lambda: gym_env.HangingSheet(server)] * 3)
        several.reset(seed=1)
        observations, rewards, *_ = several.step(np.zeros((3, 3), np.float32))
        assert observations.shape == (3, 9) and len(set(rewards)) == 3
        assert len(server.sessions()) == 6
        several.close()
        assert server.sessions() == []


def test_without_a_server_it_has_its_own_and_ends_it(gym_env: Any) -> None:
    import gymnasium

    environment: Any = gym_env.HangingSheet()
    with pytest.raises(gymnasium.error.ResetNeeded):
        environment.step(np.zeros(3, np.float32))
    process = environment._rest._server.process
    environment.reset()
    assert process.poll() is None
    environment.close()
    assert process.poll() is not None
    environment.close()
