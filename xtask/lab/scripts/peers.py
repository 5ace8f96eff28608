"""Steps a peer with random actions, and times it.

Reads numbers of transitions from standard input, one on each line. It does at least as many, and
answers with the transitions done and the seconds they took, in wall time and in process time. The time
includes resets, which do not count as transitions.
"""

import argparse
import contextlib
import io
import itertools
import time

import numpy as np

# The episodes of the contenders in Rust.
EPISODE = 50
EPISODES = 20
SEED = 0


def play_single(env):
    """Plays the episodes: only the first has a seed, the others continue its stream."""
    played = itertools.count()

    def episode(actions):
        env.reset(seed=SEED if next(played) % EPISODES == 0 else None)
        for action in actions:
            env.step(action[0])
        return EPISODE

    return episode


def gymnasium_robotics(env_id):
    # Their warnings are about environments that are not used here.
    with contextlib.redirect_stderr(io.StringIO()):
        import gymnasium
        import gymnasium_robotics

    gymnasium.register_envs(gymnasium_robotics)
    return play_single(gymnasium.make(env_id, disable_env_checker=True))


def envpool(env_id, num_envs, num_threads):
    import envpool

    envs = envpool.make(
        env_id, env_type="gymnasium", num_envs=num_envs, num_threads=num_threads, seed=SEED
    )
    envs.reset()

    def episode(actions):
        transitions = 0
        # The reset of an episode is a separate step, which does not advance the simulation.
        for action in (*actions, actions[0]):
            info = envs.step(action)[4]
            transitions += int(np.count_nonzero(info["elapsed_step"]))
        return transitions

    return episode


def fetch_env_single(env_id, model):
    """One of this project's own environments, from Python."""
    import fetch_env
    import gymnasium

    return play_single(
        gymnasium.make(f"fetch_env/{env_id}", model=model, disable_env_checker=True)
    )


def fetch_env_vector(env_id, num_envs, num_threads, model):
    """Many of them."""
    import fetch_env
    import gymnasium

    envs = gymnasium.make_vec(
        f"fetch_env/{env_id}",
        num_envs,
        num_threads=num_threads,
        autoreset_mode="SameStep",
        model=model,
    )
    envs.reset(seed=SEED)

    def episode(actions):
        for batch in actions:
            envs.step(batch)
        return EPISODE * num_envs

    return episode


def main():
    parser = argparse.ArgumentParser()
    peers = ["gymnasium-robotics", "envpool", "fetch-env", "fetch-env-vector"]
    parser.add_argument("peer", choices=peers)
    parser.add_argument("env_id")
    parser.add_argument("--num-envs", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--model", default="builtin")
    args = parser.parse_args()
    if args.peer == "fetch-env":
        episode = fetch_env_single(args.env_id, args.model)
    elif args.peer == "fetch-env-vector":
        episode = fetch_env_vector(args.env_id, args.num_envs, args.threads, args.model)
    elif args.peer == "envpool":
        episode = envpool(args.env_id, args.num_envs, args.threads)
    else:
        episode = gymnasium_robotics(args.env_id)
    shape = (EPISODES, EPISODE, args.num_envs, 4)
    actions = np.random.default_rng(SEED).uniform(-1, 1, shape).astype(np.float32)
    played = 0
    print("ready", flush=True)
    while line := next(iter(input, ""), ""):
        done, start, cpu = 0, time.perf_counter(), time.process_time()
        while done < int(line):
            done += episode(actions[played % EPISODES])
            played += 1
        print(done, time.perf_counter() - start, time.process_time() - cpu, flush=True)


if __name__ == "__main__":
    try:
        main()
    except EOFError:
        pass
