"""Overrides of stage 2 and 3 for a training ground that compiles in seconds, and for a student that learns in them."""

BLOCK_TILES = [
    "iterations=3",
    "terrain.levels=2",
    "terrain.columns=2",
    "terrain.blocks=1",
    "terrain.walls=0",
    "terrain.slope=0",
    "terrain.rough_slope=0",
    "terrain.hurdles=0",
    "terrain.bars=0",
    "terrain.ghost=0",
    "terrain.first_height=null",
    "terrain.discrete=0",
]
"""Four tiles, all of blocks."""

SMALL_STUDENT = [
    "student.camera.width=32",
    "student.camera.height=18",
    "student.distillation.steps=4",
    "student.distillation.bptt=2",
    "student.distillation.minibatches=2",
]
