"""Help and completion: three parts, all options, and what a shell makes of them."""

import shutil
import subprocess
from dataclasses import fields
from pathlib import Path

import pytest

import scantruss as st
from scantruss.cli.commands import COMMANDS
from scantruss.cli.main import main
from scantruss.cli.options import EVERY_DAY, PAPER_ONLY, option_of


def test_the_options_of_a_grid_come_in_three_parts_each_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["grid", "--help"]) == 0
    said = capsys.readouterr().out
    parts = {
        "everyday": said[said.index("EVERYDAY:") : said.index("EXPERT:")],
        "expert": said[said.index("EXPERT:") : said.index("PAPER:")],
        "paper": said[said.index("PAPER:") :],
    }
    for spec in fields(st.Settings):
        if spec.name in ("length_field", "line_names"):
            continue
        where = "everyday" if spec.name in EVERY_DAY else "paper" if spec.name in PAPER_ONLY else "expert"
        option = f"  {option_of(spec.name)}"
        assert [name for name, text in parts.items() if f"\n{option} " in text or f"\n{option}," in text] == [where]


def completed(script: str, words: list[str]) -> set[str]:
    """Return what bash offers for the last of some words."""
    place = (
        f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; _scantruss; printf '%s\\n' \"${{COMPREPLY[@]}}\""
    )
    answer = subprocess.run(["bash", "-c", f"source ./{script}; {place}"], capture_output=True, text=True, check=True)
    return set(answer.stdout.split())


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes_commands_options_and_values(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "shell.ply").touch()
    assert main(["completion", "bash"]) == 0
    (tmp_path / "script").write_text(capsys.readouterr().out)
    assert completed("script", ["scantruss", "''"]) >= set(COMMANDS)
    assert completed("script", ["scantruss", "grid", "--eff"]) == {"--effort"}
    assert completed("script", ["scantruss", "grid", "--effort", "''"]) == {"normal", "quick", "best"}
    assert completed("script", ["scantruss", "grid", "sh"]) == {"shell.ply"}
    assert completed("script", ["scantruss", "clean", "--no-sm"]) == {"--no-smooth"}


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_get_a_script_with_all_commands(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    said = capsys.readouterr().out
    assert all(name in said for name in COMMANDS) and "fixed-line" in said


def test_no_script_for_a_shell_that_is_not_known(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "csh"]) == 2
    assert "choose from" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["clean", "a.xyz", "b.xyz", "--duplicates", "5"], "most of the scan; it must be at most 1"),
        (["clean", "a.xyz", "b.xyz", "--loose-pieces", ".9"], "most of the scan; it must be at most 0.5"),
        (["clean", "a.xyz", "b.xyz", "--layer-distance", "1000"], "most of the scan; it must be at most 20"),
        (["clean", "a.xyz", "b.xyz", "--outlier-distance", ".1"], "must be 0, or 1 or more"),
        (["grid", "a.xyz", "b.obj", "--length", "1", "--outlier-distance", ".1"], "must be 0, or 1 or more"),
        (
            ["grid", "a.xyz", "b.png", "--length", "1", "--size", "big"],
            "needs WIDTHxHEIGHT in pixels such as 1600x1200",
        ),
        (["grid", "a.xyz", "b.png", "--length", "1", "--view", "sideways"], "view must be auto, behind, top"),
        (["grid", "a.xyz", "b.obj", "--length", "1", "--obj", "points"], "an OBJ file holds faces, lines, both"),
    ],
)
def test_absurd_values_ask_back(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.xyz").write_text("".join(f"{x} {y} 0\n" for x in range(20) for y in range(20)))
    assert main(words) == 2
    line = capsys.readouterr().err
    assert said in line and line.count("\n") == 1


def test_a_scale_at_which_members_are_hairs_asks_back() -> None:
    from small_grids import dome

    from scantruss.export.solid import build_solid

    with pytest.raises(
        st.InputError, match="thick, thinner than one in 2,000; give a smaller scale or a larger diameter"
    ):
        build_solid(dome(), member_diameter=1.0, node_diameter=2.0, scale=1e9)
