"""The names of gymnasium-robotics, with these environments behind them."""

import contextlib
import importlib
import subprocess
import sys
import warnings

import fetch_env
import gymnasium
import numpy as np
import pytest
from reference import assert_same_observation

PUSH = ("FetchPush-v1", "FetchPush-v2", "FetchPush-v3", "FetchPush-v4")


@pytest.fixture(autouse=True)
def registry():
    """Return Gymnasium's registry without these names, and put them back afterwards."""
    # Importing it only once registers its names.
    with contextlib.suppress(ImportError):
        importlib.import_module("gymnasium_robotics")
    before = dict(gymnasium.registry)
    for name in [name for name in before if name.startswith("Fetch")]:
        del gymnasium.registry[name]
    yield gymnasium.registry
    gymnasium.registry.clear()
    gymnasium.registry.update(before)


def test_the_plain_names_make_these_environments(env_id, actions):
    fetch_env.replace_gymnasium_robotics()
    env, other = gymnasium.make(env_id), gymnasium.make(f"fetch_env/{env_id}")
    assert type(env.unwrapped) is fetch_env.FetchEnv
    assert (env.spec.id, env.spec.max_episode_steps) == (env_id, 50)
    assert env.env.env.env is env.unwrapped
    assert_same_observation(env.reset(seed=2)[0], other.reset(seed=2)[0])
    steps = [env.step(action) for action in actions[:50]]
    assert [step[3] for step in steps] == [False] * 49 + [True]
    assert steps[9][1] == [other.step(action) for action in actions[:10]][9][1]
    envs = gymnasium.make_vec(env_id, num_envs=2)
    assert type(envs) is fetch_env.FetchVectorEnv
    assert envs.spec.id == env_id


def test_with_the_references_model_they_have_its_bits(reference, env_id, actions, registry):
    import gymnasium_robotics  # noqa: PLC0415

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        gymnasium_robotics.register_robotics_envs()
    theirs = reference(env_id)
    replaced = fetch_env.replace_gymnasium_robotics(model="reference")
    ours = gymnasium.make(env_id)
    assert type(ours.unwrapped) is fetch_env.FetchEnv
    assert_same_observation(ours.reset(seed=5)[0], theirs.reset(seed=5)[0])
    for action in actions[:20]:
        one, other = ours.step(action), theirs.step(action)
        assert_same_observation(one[0], other[0])
        assert one[4] == other[4]
        # The reference rounds distances by processor.
        assert one[1] == pytest.approx(other[1], abs=1e-15)
    assert replaced[env_id] == theirs.spec
    registry.update(replaced)
    assert gymnasium.spec(env_id).entry_point.startswith("gymnasium_robotics.")


@pytest.mark.filterwarnings("ignore:.*out of date:DeprecationWarning")
def test_older_versions_say_once_what_differs():
    fetch_env.ids.newest.cache_clear()
    fetch_env.replace_gymnasium_robotics()
    for env_id, difference in zip(PUSH, ("mujoco-py", "mocap", "posture"), strict=False):
        with pytest.warns(UserWarning, match=f"{env_id} .*{difference}.* FetchPush-v4"):
            env = gymnasium.make(env_id)
        assert isinstance(env.unwrapped, fetch_env.FetchEnv)
        assert env.spec.id == env_id
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)
            again = gymnasium.make(env_id)
            envs = gymnasium.make_vec(env_id, num_envs=3)
        assert again.metadata["render_modes"] == env.metadata["render_modes"]
        new = gymnasium.make_vec("FetchPush-v4", num_envs=3)
        assert_same_observation(envs.reset(seed=1)[0], new.reset(seed=1)[0])


def test_what_the_user_has_registered_stays(registry):
    gymnasium.register("FetchPush-v2", "mine:Push")
    before = dict(registry)
    with pytest.raises(ValueError, match="FetchPush-v2 is registered as mine:Push"):
        fetch_env.replace_gymnasium_robotics()
    assert registry == before
    del registry["FetchPush-v2"]
    gymnasium.register("FetchPush-v3", lambda: None)
    with pytest.raises(ValueError, match="FetchPush-v3"):
        fetch_env.replace_gymnasium_robotics()
    with pytest.raises(TypeError, match="did you mean model"):
        fetch_env.replace_gymnasium_robotics(modle="reference")


def test_the_last_call_counts():
    assert "FetchPush-v4" not in fetch_env.replace_gymnasium_robotics(distance_threshold=0.02)
    assert gymnasium.make("FetchPush-v4").unwrapped.distance_threshold == 0.02
    assert fetch_env.replace_gymnasium_robotics() == {}
    assert gymnasium.make("FetchPush-v4").unwrapped.distance_threshold == 0.05
    assert gymnasium.make("fetch_env/FetchPush-v4").unwrapped.distance_threshold == 0.05


REPLACE = "import fetch_env; fetch_env.replace_gymnasium_robotics()"
THEIRS = "import gymnasium_robotics; gymnasium.register_envs(gymnasium_robotics)"
MAKES = "type(gymnasium.make('{}FetchPush-v4').unwrapped).__module__"


@pytest.mark.parametrize(
    ("lines", "prefix"),
    [
        ((REPLACE,), ""),
        ((REPLACE, THEIRS), ""),
        ((THEIRS, REPLACE), ""),
        ((), "fetch_env.plain_ids:"),
        ((THEIRS,), "fetch_env.plain_ids:"),
    ],
)
def test_the_order_of_imports_does_not_matter(lines, prefix):
    if THEIRS in lines:
        pytest.importorskip("gymnasium_robotics")
    program = "\n".join(("import gymnasium", *lines, f"print({MAKES.format(prefix)})"))
    run = [sys.executable, "-W", "error:Overriding", "-c", program]
    made = subprocess.run(run, check=True, capture_output=True, text=True)  # noqa: S603
    assert made.stdout == "fetch_env.env\n"


def test_it_works_without_gymnasium_robotics(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium_robotics", None)
    assert fetch_env.replace_gymnasium_robotics() == {}
    assert np.isfinite(gymnasium.make("FetchReach-v4").reset(seed=0)[0]["observation"]).all()
