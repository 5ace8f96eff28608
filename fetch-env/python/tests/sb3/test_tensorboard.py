"""Curves, read back by TensorBoard."""

import fetch_env
import pytest

accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")

SHORT = {"evaluation_episodes": 5, "evaluation_interval": 200, "updates_per_cycle": 2}


def test_tensorboard_reads_the_curve(tmp_path):
    settings = fetch_env.train("FetchReach-v4", steps=0, progress=False).settings
    settings["schedule"].update(SHORT)
    settings["algorithm"]["ddpg"]["hidden"] = [8]
    settings["replay"]["batch_size"] = 16

    def train(**arguments):
        board = {"out": tmp_path / "run", "tensorboard": tmp_path / "board", "progress": False}
        return fetch_env.train("FetchReach-v4", settings, target=None, **board, **arguments)

    train(steps=2_000)
    curve = train(steps=3_000, resume=True).curve
    # Each call has its own file.
    files = sorted((tmp_path / "board").iterdir())
    scalars = {}
    for file in files:
        events = accumulator.EventAccumulator(str(file)).Reload()
        for name in events.Tags()["scalars"]:
            scalars.setdefault(name, []).extend(events.Scalars(name))
    assert len(files) == 2
    assert [event.step for event in scalars["success_rate"]] == [
        row["counters"]["steps"] for row in curve
    ]
    names = [name for name in scalars if name.startswith(("update/", "buffer/"))]
    assert sorted(names) == sorted(curve[-1]["diagnostics"])
    values = [event.value for event in scalars["buffer/distance"]]
    assert values == pytest.approx([row["diagnostics"]["buffer/distance"] for row in curve])
    for name in ("episode_return_mean", "final_distance_mean"):
        values = [event.value for event in scalars[name]]
        assert values == pytest.approx([row[name] for row in curve], rel=1e-6)
    losses = [row["losses"]["critic"] for row in curve if row["losses"] is not None]
    assert losses
    values = [event.value for event in scalars["critic_loss"]]
    assert values == pytest.approx(losses, rel=1e-6)
