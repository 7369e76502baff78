"""Distance fields, the building of homes, their exchange while robots drive."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from vinl.config.errors import InputError
from vinl.config.loader import build_config
from vinl.nav.config import ClutterConfig, EpisodeConfig, HomesConfig, NavConfig
from vinl.nav.environment import NavEnvironment
from vinl.nav.fields import spread_fields
from vinl.nav.home_builder import FIELD_RESOLUTION, build_home, prepare_home
from vinl.nav.home_store import HomeStore
from vinl.world.floorplan import measure_clearance
from vinl.world.free_space import distance_field
from vinl.world.grid import GridFrame
from vinl.world.readers import load_floorplan


def test_homes_of_other_layouts_come_in_their_fractions():
    homes = {"count": 24, "workers": 0, "goals": 2, "starts": 32, "layouts": {"office": 0.5, "dead_ends": 0.5}}
    config = build_config(NavConfig, {"homes": homes})
    built = [build_home(seed, config) for seed in range(24)]
    areas = np.array([home.cells * FIELD_RESOLUTION**2 for home in built if not isinstance(home, str)])
    assert len(areas) > 20 and (areas > 150).mean() > 0.4 and areas.max() > 300  # offices are large
    for layouts, words in (({"office": 0.8, "dead_ends": 0.4}, "more than 1"), ({"castle": 0.1}, "layout")):
        with pytest.raises(InputError, match=words):
            build_config(NavConfig, {"homes": {"layouts": layouts}})


def test_fields_agree_with_those_of_the_world():
    plan = load_floorplan("old_town")
    coarse = measure_clearance(plan.free, 0.05)[::2, ::2]
    mask = np.where(coarse >= 0.22, 2, np.where(coarse >= 0.12, 1, 0)).astype(np.uint8)
    goals = np.argwhere(mask == 2)[[5, 700]]
    fields = spread_fields(mask, goals, 0.1)
    for k, goal in enumerate(goals):
        assert fields[goal[0], goal[1], k] == 0
        frame = GridFrame(0.0, 0.0, 0.1, mask.shape)
        other = distance_field(mask == 2, frame, frame.xy(goal))
        known = np.isfinite(other) & (mask == 2)
        assert (np.isfinite(fields[..., k]) == known)[mask == 2].all()
        ratio = fields[..., k][known].astype(float) / np.maximum(other[known], 0.1)
        assert ratio[other[known] > 1].min() > 0.97 and ratio.max() < 1.08


def test_generated_homes_are_the_same_from_their_seed(config):
    config = replace(config, clutter=ClutterConfig(share=1.0))
    first, again, other = (build_home(seed, config) for seed in (5, 5, 6))
    assert not isinstance(first, str) and not isinstance(again, str) and not isinstance(other, str)
    assert (first.fields == again.fields).all() and (first.vertices == again.vertices).all()
    assert first.fields.shape != other.fields.shape or (first.fields != other.fields).any()
    assert first.clearance.shape == (2 * first.fields.shape[0], 2 * first.fields.shape[1])
    assert len(first.blocks) > 3 and first.blocks[:, 5].max() <= 0.2


def test_a_home_without_a_path_is_dropped_and_counted(config):
    far = replace(config, episodes=EpisodeConfig(distance=(300.0, 400.0)))
    plan = load_floorplan("harbour_flat")
    why = prepare_home(plan, 1, far)
    assert isinstance(why, str) and "hardly any path" in why
    with pytest.raises(InputError, match="300 m to 400 m"):
        HomeStore.from_plans([plan], far)
    near = replace(config, episodes=EpisodeConfig(distance=(17.0, 30.0)))  # only the largest homes
    seeds = [build_home(seed, near) for seed in range(1, 30)]
    kept = [home.seed for home in seeds if not isinstance(home, str)][:2]
    store = HomeStore.build(replace(near, homes=replace(near.homes, count=2)))
    assert [record.seed for record in store.records] == kept
    assert len(store.reasons) == kept[-1] - 2 > 0


def test_workers_build_the_homes_of_the_seeds(config):
    small = replace(config, homes=HomesConfig(count=2, workers=1, goals=4, starts=64))
    alone = replace(small, homes=replace(small.homes, workers=0))
    stores = [HomeStore.build(settings) for settings in (small, alone)]
    assert stores[0].save_state() == stores[1].save_state()


def test_robots_begin_anew_in_other_homes(config):
    store = HomeStore.from_plans([load_floorplan("harbour_flat"), load_floorplan("old_town")], config)
    saved = NavEnvironment(config, store).save_state()
    other = NavEnvironment(config, HomeStore.from_plans([load_floorplan("mill_loft")], config))
    other.load_state(saved)
    assert not other.step(torch.tensor([[-1.0, 0.0]]).expand(32, 2)).done.any() and (other.state["home"] == 0).all()


def test_settings_are_checked():
    with pytest.raises(InputError, match=r"homes\.plans names no floor plan"):
        HomesConfig(plans_share=0.5)
    with pytest.raises(InputError, match=r"episodes\.distance"):
        EpisodeConfig(distance=(5.0, 2.0))
    with pytest.raises(InputError, match="num_envs"):
        NavConfig(num_envs=0)
