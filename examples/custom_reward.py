"""A reward of one's own: hurry, but keep a metre away from people. Run `python examples/custom_reward.py`."""

import gymnasium as gym

import socnav_env  # noqa: F401 registers SocNav2-v0
from socnav_env.rewards import CrowdNavReward, MixedReward, Moment


class PersonalSpace:
    """Any object with these three is a reward; the environment multiplies the terms by their weights."""

    weights = {"time": -1.0, "intrusion": -5.0}  # noqa: RUF012 a plain example
    scorer = None  # it does not ask the network

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return the same terms at every step."""
        closest = moment.world.clearance_to_people().min(initial=1.0)
        return {"time": moment.duration, "intrusion": (1.0 - closest) * moment.duration}


crowdnav = CrowdNavReward({"discomfort": 0.5, "arrival": 1.0, "contact": -0.25}, discomfort_distance=0.2)
both = MixedReward({"space": (1.0, PersonalSpace()), "crowdnav": (10.0, crowdnav)})
for reward in (PersonalSpace(), both):
    env = gym.make("SocNav2-v0", reward=reward)
    env.reset(seed=1)
    _, value, _, _, info = env.step([1.0, 0.0])
    print(f"{value:.3f} =", " + ".join(f"{name} {term:.3f}" for name, term in info["reward_terms"].items()))
