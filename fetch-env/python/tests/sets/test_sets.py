"""The sets of `fetch-env datasets` in the folder FETCH_ENV_SETS, as others read them."""

import os
from pathlib import Path

import numpy as np
import pytest

minari = pytest.importorskip("minari")

from episodes import (  # noqa: E402
    assert_is_the_environments_own,
    assert_ogbench_has,
    assert_same,
    seeds,
)

if "FETCH_ENV_SETS" not in os.environ:
    pytest.skip("FETCH_ENV_SETS names no folder with sets", allow_module_level=True)
FOLDER = Path(os.environ["FETCH_ENV_SETS"])
SETS = sorted(path.relative_to(FOLDER / "minari") for path in FOLDER.glob("minari/fetch/*/*-v0"))
# The most episodes of a set that are simulated again.
SIMULATED = 40


@pytest.fixture(params=[str(path) for path in SETS])
def dataset(request, monkeypatch):
    """Return each data set in turn, as Minari loads it."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(FOLDER / "minari"))
    return minari.load_dataset(request.param)


def spread(count, at_most):
    """Return at most `at_most` numbers below a count, evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(count, at_most)).astype(int))


def test_every_kind_of_every_environment_is_there():
    tasks = ["pick-and-place", "push", "reach", "slide"]
    kinds = ["expert", "expert-noisy", "mixed", "random", "replay", "scripted"]
    names = [name for task in tasks for name in (task, f"{task}-dense")]
    assert {path.parts[1:] for path in SETS} == {(n, f"{k}-v0") for n in names for k in kinds}


def test_minari_reads_what_the_environment_gives(dataset):
    env = dataset.recover_environment()
    assert dataset.observation_space == env.observation_space
    assert dataset.action_space == env.action_space
    assert sum(len(episode) for episode in dataset) == dataset.total_steps
    numbers = seeds(dataset)
    assert len(set(numbers)) == dataset.total_episodes
    for index in spread(dataset.total_episodes, SIMULATED):
        assert_is_the_environments_own(env, numbers[index], dataset[int(index)])
    dataset.set_seed(0)
    for episode in dataset.sample_episodes(2):
        assert_same(episode.actions, dataset[episode.id].actions)


def test_minari_combines_sets(tmp_path, monkeypatch):
    for path in SETS:
        place = tmp_path / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.symlink_to(FOLDER / "minari" / path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    for task in sorted({path.parent for path in SETS}):
        parts = [minari.load_dataset(str(path)) for path in SETS if path.parent == task]
        combined = minari.combine_datasets(parts, f"{task}/all-v0")
        assert combined.total_steps == sum(part.total_steps for part in parts)
        last = combined[combined.total_episodes - 1]
        assert_same(last.actions, parts[-1][parts[-1].total_episodes - 1].actions)


def test_ogbench_reads_the_same(dataset):
    assert_ogbench_has(dataset, FOLDER / "ogbench" / dataset.id.replace("/", "-"))
