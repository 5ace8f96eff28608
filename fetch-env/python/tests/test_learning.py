"""The buffer, the policies and the learner."""

import copy
import json
import pickle
import time

import fetch_env
import numpy as np
import pytest

WIDTHS = {
    "observation": 25,
    "achieved_goal": 3,
    "desired_goal": 3,
    "action": 4,
    "next_observation": 25,
    "next_achieved_goal": 3,
}


@pytest.fixture(params=["NextStep", "SameStep"])
def recorded(request, actions):
    """Return environments and a buffer that has two episodes of each."""
    envs = fetch_env.FetchVectorEnv("FetchPush-v4", 2, autoreset_mode=request.param)
    buffer = fetch_env.HerBuffer(envs, 1000)
    envs.reset(seed=0)
    buffer.record(envs)
    for step in range(101):
        envs.step(actions[step % 59 : step % 59 + 2])
        buffer.record(envs)
    return envs, buffer


def test_every_step_is_recorded(recorded):
    _, buffer = recorded
    assert (len(buffer), buffer.num_episodes, buffer.capacity) == (200, 4, 1000)


@pytest.mark.parametrize("strategy", ["future", "final", "episode", "random"])
def test_batches_keep_the_law_of_rewards(recorded, strategy):
    envs, buffer = recorded
    batch = buffer.sample(64, strategy=strategy)
    for key, width in WIDTHS.items():
        assert batch[key].shape == (64, width)
        assert batch[key].dtype == np.float32
        assert batch[key].flags.owndata or batch[key].base is not None
    rewards = envs.compute_reward(batch["next_achieved_goal"], batch["desired_goal"])
    np.testing.assert_array_equal(batch["reward"], rewards)
    assert 0 < batch["relabeled"].sum() < 64
    assert not batch["terminated"].any()
    assert not buffer.sample(64, k=0)["relabeled"].any()


def test_seeds_decide_batches(recorded):
    _, buffer = recorded

    def draw(**seed):
        return buffer.sample(16, **seed)["observation"].tobytes()

    assert draw(seed=3) == draw(seed=3) != draw(seed=4)
    assert draw() != draw()


def test_a_buffer_is_filled_step_by_step(actions):
    env = fetch_env.FetchEnv("FetchReach-v4")
    buffer = fetch_env.HerBuffer(env, 100)
    observation, _ = env.reset(seed=0)
    buffer.begin_episode(observation)
    seen = [observation]
    rewards = []
    for action in actions[:10]:
        observation, reward, terminated, _, _ = env.step(action)
        last = len(seen) == 10
        buffer.add_step(action, observation, reward, terminated=terminated, truncated=last)
        seen.append(observation)
        rewards.append(reward)
    other = fetch_env.HerBuffer(env, 100)
    rows = {key: [each[key] for each in seen] for key in ("observation", "achieved_goal")}
    goal = seen[0]["desired_goal"]
    other.add_episode(**rows, desired_goal=goal, action=actions[:10], reward=rewards)
    assert len(buffer) == len(other) == 10
    batches = [each.sample(32, seed=1) for each in (buffer, other)]
    for key, numbers in batches[0].items():
        np.testing.assert_array_equal(numbers, batches[1][key])


@pytest.mark.parametrize("again", ["pickle", "deepcopy", "file"])
def test_a_buffer_is_kept(recorded, tmp_path, again):
    envs, buffer = recorded
    if again == "file":
        buffer.save(tmp_path / "buffer")
        other = fetch_env.HerBuffer(envs, 50)
        other.load(tmp_path / "buffer")
    else:
        other = copy.deepcopy(buffer) if again == "deepcopy" else pickle.loads(pickle.dumps(buffer))
    assert (len(other), other.capacity) == (200, 1000)
    for key, numbers in buffer.sample(32, seed=5).items():
        np.testing.assert_array_equal(numbers, other.sample(32, seed=5)[key])


def test_a_restored_state_is_not_joined_to_the_steps_before(actions):
    envs = fetch_env.FetchVectorEnv("FetchReach-v4", 2)
    buffer = fetch_env.HerBuffer(envs, 100)
    envs.reset(seed=0)
    buffer.record(envs)
    state = envs.get_state()
    for again in (False, True):
        if again:
            envs.set_state(state)
            buffer.record(envs)
        envs.step(actions[:2])
        buffer.record(envs)
    assert (len(buffer), buffer.num_episodes, buffer.unfinished_steps()) == (2, 2, 1)


def test_an_episode_under_way_is_kept_and_can_be_discarded(push, actions, tmp_path):
    buffer = fetch_env.HerBuffer(push, 100)
    start, _ = push.reset()
    buffer.begin_episode(start)
    observation, reward, *_ = push.step(actions[0])
    buffer.add_step(actions[0], observation, reward, terminated=False, truncated=False)
    buffer.save(tmp_path / "buffer")
    other = fetch_env.HerBuffer(push, 100)
    other.load(tmp_path / "buffer")
    for each in (other, pickle.loads(pickle.dumps(buffer))):
        assert each.unfinished_steps() == 1
        with pytest.raises(ValueError, match="discard_episode"):
            each.begin_episode(start)
        each.discard_episode()
        assert each.unfinished_steps() is None
        each.begin_episode(start)
        assert len(each) == 0


def test_what_a_buffer_refuses(recorded, tmp_path):
    _, buffer = recorded
    reach = fetch_env.FetchVectorEnv("FetchReach-v4", 2)
    reach.reset(seed=0)
    with pytest.raises(ValueError, match=r"FetchReach-v4.* than the buffer .*FetchPush-v4"):
        buffer.record(reach)
    with pytest.raises(ValueError, match="future"):
        buffer.sample(8, strategy="past")
    with pytest.raises(ValueError, match="batch"):
        buffer.sample(0)
    with pytest.raises(ValueError, match="episode"):
        fetch_env.HerBuffer(reach, 100).sample(8)
    with pytest.raises(FileNotFoundError, match="No such file"):
        buffer.load(tmp_path / "missing")
    (tmp_path / "damaged").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="the file ends"):
        buffer.load(tmp_path / "damaged")
    for k in (-1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="from 0 on"):
            buffer.sample(8, k=k)
    for call in (
        lambda: buffer.sample(-1),
        lambda: buffer.sample(8, seed=-1),
        lambda: buffer.unfinished_steps(env_index=-1),
        lambda: fetch_env.HerBuffer(reach, -1),
    ):
        with pytest.raises(ValueError, match="from 0 to"):
            call()
    buffer.clear()
    assert len(buffer) == 0


def test_shipped_policies_reach_their_goals(task_id):
    policy = fetch_env.Policy.shipped(task_id)
    rate = fetch_env.evaluate(task_id, policy, 20, seed=100)["success_rate"]
    expected = policy.header["success"]["rate"]["value"]
    assert rate["value"] >= expected - 0.25
    assert rate["low"] <= rate["value"] <= rate["high"]


def test_a_policy_acts_alone_and_among_many(tmp_path):
    policy = fetch_env.Policy.shipped("fetch_env/FetchPush-v4")
    env = fetch_env.FetchEnv("FetchPush-v4")
    observations = [env.reset(seed=seed)[0] for seed in range(3)]
    together = policy({key: np.stack([o[key] for o in observations]) for key in observations[0]})
    assert together.shape == (3, 4)
    assert together.dtype == np.float32
    policy.save(tmp_path / "policy")
    for other in (
        policy,
        fetch_env.Policy.load(tmp_path / "policy"),
        pickle.loads(pickle.dumps(policy)),
    ):
        for observation, action in zip(observations, together, strict=True):
            np.testing.assert_array_equal(other(observation), action)
            np.testing.assert_array_equal(other.predict(observation)[0], action)


def test_what_is_no_policy_is_refused(tmp_path):
    (tmp_path / "policy").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="not a policy"):
        fetch_env.Policy.load(tmp_path / "policy")
    with pytest.raises(FileNotFoundError, match="missing cannot be read"):
        fetch_env.Policy.load(tmp_path / "missing")
    policy = fetch_env.Policy.shipped("FetchReach-v4")
    env = fetch_env.FetchEnv("FetchPush-v4")
    with pytest.raises(ValueError, match="observation has the shape"):
        policy(env.reset(seed=0)[0])


def test_reach_is_learned(capsys):
    training = fetch_env.train("FetchReach-v4", target=1.0, steps=20_000)
    assert "success rate 1.00" in capsys.readouterr().err
    assert [row["success_rate"]["value"] for row in training.curve[-2:]] == [1.0, 1.0]
    rate = fetch_env.evaluate("FetchReach-v4", training.policy, 50)["success_rate"]["value"]
    assert rate >= 0.9
    assert training.policy.header["env_id"] == "FetchReach-v4"
    # The settings of a run are those of another.
    rows = []
    again = fetch_env.train(
        "FetchReach-v4", training.settings, target=1.0, steps=20_000, progress=rows.append
    )
    for row in (*training.curve, *again.curve):
        del row["counters"]["seconds"]
    assert again.curve == training.curve
    assert len(rows) == len(again.curve)
    assert json.dumps(again.settings) == json.dumps(training.settings)


@pytest.mark.parametrize(
    ("preset", "algorithm"),
    [
        ("fast", "ddpg"),
        ("book", "sac"),
        ("authors", "ddpg"),
        ("fast-ppo", "ppo"),
        ("book-ppo", "ppo"),
    ],
)
def test_a_policy_of_each_preset_acts(preset, algorithm):
    training = fetch_env.train("FetchReach-v4", preset, steps=1_000, progress=False)
    assert list(training.settings["algorithm"]) == [algorithm]
    summary = fetch_env.evaluate("FetchReach-v4", training.policy, 1)
    assert summary["episode_length_mean"]["value"] == 50.0


def test_what_the_learner_refuses(tmp_path):
    def train(*arguments, **settings):
        fetch_env.train("FetchReach-v4", *arguments, progress=False, **settings)

    policy = fetch_env.Policy.shipped("FetchReach-v4")
    with pytest.raises(
        ValueError, match=r"no preset slow; .* All are: authors, book, book-ppo, fast, fast-ppo"
    ):
        train("slow")
    with pytest.raises(ValueError, match=r"these are not settings of the learner: .*rate"):
        train({"rate": 1.0})
    with pytest.raises(ValueError, match="at least one"):
        fetch_env.evaluate("FetchReach-v4", policy, 0)
    for call in (train, lambda **settings: fetch_env.evaluate("FetchReach-v4", policy, **settings)):
        with pytest.raises(ValueError, match="from 0 to"):
            call(seed=-1)
        with pytest.raises(FileNotFoundError, match="download_reference_model"):
            call(model=tmp_path)


def test_a_curve_of_robustness():
    policy = fetch_env.Policy.shipped("FetchReach-v4")
    noise = [0, 0.02, 2]
    curve = fetch_env.robustness("FetchReach-v4", policy, "observation_noise", noise, 20, seed=3)
    assert curve["factor"] == "observation_noise"
    plain, noisy, blind = curve["points"]
    assert {"value": 0.0, **fetch_env.evaluate("FetchReach-v4", policy, 20, seed=3)} == plain
    settings = {"variation": {"observation_noise": 0.02}}
    varied = fetch_env.evaluate("FetchReach-v4", policy, 20, seed=3, **settings)
    assert {"value": 0.02, **varied} == noisy
    assert plain["success_rate"]["value"] == 1.0 > blind["success_rate"]["value"]
    assert 1.0 <= plain["steps_to_success_mean"]["value"] < 10.0
    assert plain["path_mean"]["value"] > 0.0
    assert plain["energy_mean"]["value"] < blind["energy_mean"]["value"]
    assert curve["success"]["critical_value"] == 2.0
    assert 0.0 < curve["success"]["area"] <= curve["success_any"]["area"] <= 2.0
    with pytest.raises(ValueError, match="observation_noise"):
        fetch_env.robustness("FetchReach-v4", policy, "observation_nois", [0.0])


def test_ctrl_c_ends_an_evaluation(ctrl_c):
    policy = fetch_env.Policy.shipped("FetchReach-v4")
    start = time.monotonic()
    ctrl_c.start()
    with pytest.raises(KeyboardInterrupt):
        fetch_env.evaluate("FetchReach-v4", policy, 20_000)
    assert time.monotonic() - start < 10.0
