"""Several processes of one training: one verdict, one run folder, robots of their own."""

import numpy as np
import torch

from vinl.rl.parallel import FollowerFolder, PeerLoop, Peers
from vinl.rl.run_folder import RunFolder


class Env:
    """Eight robots, one of which went wrong."""

    num_envs = 8

    def take_lost(self):
        return [{"reason": "physics", "qpos": np.zeros(19)}]


def test_all_processes_end_where_the_robots_of_one_went_wrong(tmp_path):
    class Other(Peers):
        wrong = False

        def any(self, flag, device="cpu"):
            return flag or self.wrong

    run = RunFolder(tmp_path / "run")
    run.create({"seed": 3})
    loop = PeerLoop.__new__(PeerLoop)
    loop.peers, loop.env, loop.steps, loop.device = Other(1, 2), Env(), 4, "cpu"
    loop.folder = FollowerFolder(run, 1)
    assert loop.samples_per_iteration == 2 * 8 * 4
    assert loop._judge({"not_finite": 0.0}, 3) is None
    assert "8 of 32 robot steps in iteration 3" in loop._judge({"not_finite": 8.0}, 3)
    kept = np.load(run.path / "not_finite" / "000001.npz")
    assert str(kept["config"]) == "seed: 3\n"
    loop.peers.wrong = True
    assert "another process" in loop._judge({"not_finite": 0.0}, 3)


def test_a_follower_takes_the_runs_weights_and_its_own_robots(tmp_path):
    run = RunFolder(tmp_path / "run")
    run.save_checkpoint({"algorithm": {"w": 1}, "environment": {"x": 1}, "random": {}, "iteration": 4})
    follower = FollowerFolder(run, 1)
    anew = follower.load_checkpoint()
    assert anew["algorithm"] == {"w": 1} and anew["environment"] is None and "cpu" in anew["random"]
    random = {"cpu": torch.get_rng_state()}
    follower.save_checkpoint({"algorithm": {"w": 2}, "environment": {"x": 2}, "random": random})
    own = follower.load_checkpoint()
    assert (own["algorithm"], own["environment"], own["iteration"]) == ({"w": 1}, {"x": 2}, 4)
