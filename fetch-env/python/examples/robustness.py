"""Compare what two policies of Push stand: the trained one, and one trained in worlds that vary."""

import fetch_env

FACTORS = {
    "object_mass": [0.5, 1.0, 2.0, 4.0],  # kg; 2 is the reference's
    "friction": [0.5, 1.0, 2.0],  # a scale
    "observation_noise": [0.0, 0.01, 0.02],  # standard deviation
}


def curves(episodes, factors=FACTORS):
    """Return the success rate at each value of each factor: by factor, a list for each policy."""
    policies = [fetch_env.Policy.shipped("FetchPush-v4", robust=robust) for robust in (False, True)]
    return {
        factor: [rates(policy, factor, values, episodes) for policy in policies]
        for factor, values in factors.items()
    }


def rates(policy, factor, values, episodes):
    """Return the policy's success rate at each value."""
    curve = fetch_env.robustness("FetchPush-v4", policy, factor, values, episodes)
    return [point["success_rate"]["value"] for point in curve["points"]]


if __name__ == "__main__":
    for factor, (trained, robust) in curves(episodes=100).items():
        print(f"{factor:>18} {'trained':>8} {'robust':>8}")
        for row in zip(FACTORS[factor], trained, robust, strict=True):
            print("{:18.2f} {:8.2f} {:8.2f}".format(*row))
