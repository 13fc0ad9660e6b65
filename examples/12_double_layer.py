"""A limpet that is its own mirror image, as a double layer: what the workshop makes of it, and a printed model of 1:100."""

from pathlib import Path

from clouds import make

import scantruss as st
from scantruss.schedules.records import Schedules
from scantruss.structure.layered import grid_in_metres


def main(folder: Path = Path()) -> tuple[st.Truss, Schedules]:
    """Keep the mirror plane, put a second layer 1 m under the grid, and write schedules, plans and the model."""
    shell = make("limpet", 40_000)
    grid = st.grid_from_points(shell.points, st.Settings(length=12.0, unit="mm", symmetry="auto"))
    truss = st.Truss.from_grid(
        grid, scale=300, supports="boundary", loads="self,snow:1kN/m2", double_layer="1m", sharp_bends="reduce"
    )
    made = st.schedule(truss, st.ScheduleSettings())
    st.write_schedules(made, folder / "limpet.csv")
    st.write_setting_out(st.set_out(truss), folder / "limpet.pdf")
    model = grid_in_metres(truss)
    st.print_model(model, folder / "limpet.stl", member_diameter=0.0015, node_diameter=0.003, scale=0.01)
    print(
        f"{len(made.nodes):,} balls of {len(made.node_types):,} types, {len(made.members):,} members of {len(made.lengths):,} lengths"
    )
    return truss, made


if __name__ == "__main__":
    main()
