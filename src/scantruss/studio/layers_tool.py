"""Fields of a double layer and of the joints: what the next structure is asked for, and how its layers are said."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..layouts.double_layer import BEND_WAYS, DEPTH_WAYS
from ..layouts.layer_parts import LAYER_EDGES, SECOND_LAYERS
from ..structure.options import StructureSettings
from ..structure.truss import HELD_LAYERS

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..structure.truss import Truss

LAYER_CHOICES = (
    "second_layer",
    "layer_edges",
    "depth_along",
    "held_layer",
    "sharp_bends",
)  #: settings that are chosen of a list
LAYERS_FOLDER = "Double layer and joints"
AS_USUAL = "as usual"  #: of edges: tapered of the dual, else closed


class LayersTool:
    """What is said of a second layer, of more, and of the joints.

    Parameters
    ----------
    kept : StructureSettings
        What is shown first.
    """

    def __init__(self, gui: Any, kept: StructureSettings) -> None:
        ways = (
            ("second layer", SECOND_LAYERS, "nodes under the panels, or the same as the grid, under its nodes"),
            ("its edges", (AS_USUAL, *LAYER_EDGES), "as usual is tapered of the dual, closed by verticals of the same"),
            ("depth along", DEPTH_WAYS, "the smoothed normals of the grid, or z"),
            ("supports on", HELD_LAYERS, "the grid, or the last layer, in the nodes nearest to those named"),
            ("sharp bends", BEND_WAYS, "refuse a depth that is too much where the grid bends, or reduce it there"),
        )
        self._folder = gui.add_folder(LAYERS_FOLDER, expand_by_default=False)
        with self._folder:
            depth = gui.add_text(
                "depth", kept.double_layer, hint="of a second layer below the grid, in metres or as 800mm; 1.2,0.8 is three layers"
            )  # fmt: skip
            lists = {
                name: gui.add_dropdown(label, known, initial_value=getattr(kept, name) or AS_USUAL, hint=hint)
                for name, (label, known, hint) in zip(LAYER_CHOICES, ways, strict=True)
            }
            joints = gui.add_text(
                "joints", kept.joints, hint="rigid, pinned or Nm/rad; empty: rigid, of a double layer pinned"
            )
        self.fields = {"double_layer": depth, **lists, "joints": joints}
        self._name_folder(kept)

    def value(self, name: str) -> str:
        """Return what the field of a setting says."""
        said = "".join(str(self.fields[name].value).split()) if name not in LAYER_CHOICES else self.fields[name].value
        return "" if said == AS_USUAL else str(said)

    def show(self, asked: StructureSettings, show_text: Callable[[Any, str], None]) -> None:
        """Show what is asked for.

        Parameters
        ----------
        show_text : callable
            ``show_text(field, text)`` writes into a field in which nobody types.
        """
        for name, each in self.fields.items():
            wanted = getattr(asked, name)
            if name in LAYER_CHOICES:
                each.value = wanted or AS_USUAL
            elif self.value(name) != wanted:
                show_text(each, wanted)
        self._name_folder(asked)

    def _name_folder(self, asked: StructureSettings) -> None:
        self._folder.label = LAYERS_FOLDER + (f" ({words_of_depths(asked)})" if asked.double_layer else "")


def words_of_depths(asked: StructureSettings) -> str:
    """Return the depths of the layers that are asked for, and of what kind they are."""
    depths = asked.double_layer.replace(",", " and ")
    return f"{depths}{' m' * depths[-1:].isdecimal()} {asked.second_layer}"


def figures_of_layers(truss: Truss) -> list[tuple[str, str]]:
    """Return members, mean length and its deviation of each layer and of the webs, in words; none of a single layer."""
    if truss.layers is None:
        return []
    lengths = {name: truss.lengths[members] for name, members in truss.member_sets.items()}
    return [
        (name, f"{len(own):,} members of {own.mean():.3g} m, std/mean {own.std() / own.mean():.3f}")
        for name, own in lengths.items()
    ]
