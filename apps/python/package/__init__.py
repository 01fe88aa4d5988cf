# SPDX-License-Identifier: Apache-2.0
"""Pokes and draws organs baked by organbake, on the CPU, with the truth beside every picture."""
from ._organplay import Mesh, Picture, Pictures, Player, Scope, State, Step, View, __version__
from .notebook import show

__all__ = ["Mesh", "Picture", "Pictures", "Player", "Scope", "State", "Step", "View", "__version__",
           "show"]
