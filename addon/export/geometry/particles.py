"""Values of particles, for the objects that a particle system places: the outputs of Blender's Particle Info node."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .hashes import WORD, hash_words

# Outputs, and how many numbers each has.
OUTPUTS: Mapping[str, int] = {"Index": 1, "Random": 1, "Age": 1, "Lifetime": 1, "Location": 3, "Size": 1,
                              "Velocity": 3, "Angular Velocity": 3}  # fmt: skip


def particle_of(instance: Any, frame: float) -> dict[str, tuple[float, ...]]:
    """Read an instance's particle at a frame; as Cycles, none for children of particles and other objects."""
    system = instance.particle_system if instance.is_instance else None
    number = instance.persistent_id[0]
    if system is None or not 0 <= number < len(system.particles):
        return {}
    one = system.particles[number]
    return {"Index": (float(number),), "Age": (frame - one.birth_time,), "Lifetime": (one.lifetime,),
            "Location": tuple(one.location), "Size": (one.size,), "Velocity": tuple(one.velocity),
            "Angular Velocity": tuple(one.angular_velocity)}  # fmt: skip


def output(particle: Mapping[str, tuple[float, ...]], name: str) -> tuple[float, ...]:
    """Return an output of Particle Info. What is no particle has zeros, and the random number of particle 0."""
    if name == "Random":
        number = int(particle.get("Index", (0.0,))[0])
        return (float(hash_words(np.array([number]), 0)[0]) / WORD,)
    return particle.get(name, (0.0,) * OUTPUTS[name])
