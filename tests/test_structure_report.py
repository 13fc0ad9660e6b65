"""The report of a structure: HTML, PDF and a picture, the same bytes for the same structure."""

import json
import re
import tomllib
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from small_grids import dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.report.structural.contents import report_parts
from scantruss.report.structural.parts import DataTable
from scantruss.report.structural.pdf import TEXT_WIDTH, _width, _wrapped
from scantruss.report.structural.source import ReportSource, greatest_stresses
from scantruss.report.structural.words import fixed, load_words, supports_in_words
from scantruss.runtime.ours import kind_of_ours
from scantruss.structure.options import StructureSettings, read_structure_settings, settings_text
from scantruss.structure.report import report_structure

LOADS = "self,cladding:0.5kN/m2,snow:1kN/m2"


class Reader(HTMLParser):
    """The text of a page, its addresses, and whether every element ends."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text: list[str] = []
        self.tables = 0
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("meta", "img"):
            self.open.append(tag)
        self.tables += tag == "table"
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the grid of a dome, 1:50 in mm."""
    monkeypatch.chdir(tmp_path)
    st.write(dome(5, 40.0), "grid.json")
    return tmp_path


def run(words: str) -> int:
    return main(f"structure grid.json {words} --scale 50 --supports boundary".split())


def read(path: str) -> Reader:
    reader = Reader()
    reader.feed(Path(path).read_text(encoding="utf-8"))
    reader.close()
    return reader


def test_a_page_holds_everything_and_asks_the_network_for_nothing(place: Path) -> None:
    assert run(f"a.html --loads {LOADS} --size 2 --buckling 2 --frequencies 1 --report r.json") == 0
    page, figures = read("a.html"), json.loads(Path("r.json").read_text())
    assert page.open == [] and all(address.startswith("data:image/") for address in page.addresses)
    assert len(page.addresses) == 3 + 2 + 1 + 2  # forces, utilization, displacements; modes; sizing
    assert not re.search(r"@import|url\(", Path("a.html").read_text())
    text = " ".join(page.text)
    for words in (
        "Assumptions",
        "6.3.1",
        "EN 1990 6.10",
        "Reactions",
        "Sections and masses",
        "Members that are used most",
    ):
        assert words in text
    assert f"{figures['utilization_max']:.2f}" in text and f"{figures['mass']:,.0f}" in text
    assert f"{figures['buckling_factors'][0]:.3g}" in text and f"{figures['frequencies'][0]:.3g} Hz" in text
    assert Path("a.html").stat().st_size < 700_000


def test_stability_is_said_not_to_have_been_looked_at_unless_it_was(place: Path) -> None:
    for modes, looked_at in (("", False), ("--buckling 1", True)):
        assert run(f"b.html --loads {LOADS} {modes}") == 0
        text = Path("b.html").read_text()
        assert ("5.2.1(3)" in text) == looked_at
        assert ("the stability of the whole (buckling modes)" in text) != looked_at


def test_the_settings_of_a_report_make_the_same_structure(place: Path) -> None:
    assert run(f"a.html a.json --loads {LOADS} --section SHS100x5 --support-type fixed") == 0
    text = next(part for part in read("a.html").text if "# structure.toml" in part)
    command, _, settings = text.partition("# structure.toml")
    assert command.startswith("scantruss structure grid.json a.html a.json ") and "--section SHS100x5" in command
    assert tomllib.loads(settings)["support_type"] == "fixed"
    Path("structure.toml").write_text(settings)
    assert main("structure grid.json b.json --settings structure.toml".split()) == 0
    assert Path("a.json").read_bytes() == Path("b.json").read_bytes()


def test_settings_written_as_text_are_read_back(place: Path) -> None:
    Path("own.toml").write_text("""
supports = "boundary"
joints = "5000"
slenderness = 150
[[loads]]
load = "half-snow:1kN/m2@30"
[[loads]]
case = "a \\"lamp\\""
force = [0, 0, "-2kN"]
nodes = ["N025"]
[[combinations]]
name = "all"
state = "ULS"
factors = { "half-snow 30" = 1.5, "a \\"lamp\\"" = 1.35 }
""")
    settings = read_structure_settings("own.toml")
    Path("again.toml").write_text(settings_text(settings))
    assert read_structure_settings("again.toml") == settings
    assert settings_text(StructureSettings(supports="corners")).count("\n") > 15


def test_the_same_structure_gives_the_same_bytes(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import matplotlib

    for folder, size in (("one", 10.0), ("two", 17.0)):  # whatever the user's own defaults are
        Path(folder).mkdir()
        st.write(dome(4, 40.0), f"{folder}/grid.json")
        monkeypatch.chdir(place / folder)
        with matplotlib.rc_context({"font.size": size, "axes.grid": size > 10}):
            assert run("a.html a.pdf a.png") == 0
        monkeypatch.chdir(place)
    for name in ("a.html", "a.pdf", "a.png"):
        assert Path("one", name).read_bytes() == Path("two", name).read_bytes()


def test_a_pdf_has_pages_and_no_date(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"a.pdf --loads {LOADS} --buckling 1") == 0
    content = Path("a.pdf").read_bytes()
    assert content.startswith(b"%PDF-") and content.rstrip().endswith(b"%%EOF") and b"CreationDate" not in content
    assert len(re.findall(rb"/Type /Page\b(?!s)", content)) >= 3
    assert kind_of_ours(Path("a.pdf")) == "result"
    assert run("a.pdf") == 0  # ours: it may be replaced
    Path("a.pdf").write_bytes(b"%PDF-1.4\n1 0 obj << /Creator (Somebody) >> endobj\n%%EOF\n")
    capsys.readouterr()
    assert run("a.pdf") == 2
    assert "is not a result that ScanTruss wrote" in capsys.readouterr().err


def test_lines_of_a_pdf_fit_and_lose_nothing() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        words = " ".join("m" * int(n) for n in rng.integers(1, 90, 12))
        lines = _wrapped(words, 9.0, TEXT_WIDTH)
        assert max(_width(line, 9.0) for line in lines) <= TEXT_WIDTH
        assert "".join(lines).replace(" ", "") == words.replace(" ", "")


def test_what_is_left_out_of_a_table_is_said(place: Path) -> None:
    """Moments of held feet have a column; long lists of modes and combinations say how many there are."""
    st.write(dome(20, 40.0), "grid.json")
    loads = f"{LOADS},half-snow:1kN/m2,wind:1kN/m2:-0.5,temperature:20K"
    assert run(f"a.html --loads {loads} --support-type fixed --frequencies 6") == 0
    text = " ".join(read("a.html").text)
    assert "moment, greatest [kNm]" in text and "The 60 greatest of 76" in text and "All values: " in text
    assert "Those that use the members or move the nodes most" in text


def test_what_the_table_on_the_terminal_leaves_out_is_counted(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"b.json --loads {LOADS},wind:9e9kN/m2:-0.7,temperature:30K --report r.json") == 0
    said = capsys.readouterr().out.splitlines()
    shown = next(number for number, line in enumerate(said) if line.startswith("and "))
    cases = json.loads(Path("r.json").read_text())["cases"]
    assert said[shown].startswith(f"and {len(cases) - shown + 1} more combinations")
    warm = next(line.split() for line in said if line.startswith("temperature"))
    assert warm[1:3] == ["0", "0"]  # nothing is applied, so rounding is no reaction
    assert said[4].split()[0] == "wind" and said[4].endswith("> 1000")


def test_the_nonlinear_path_is_in_the_report(place: Path) -> None:
    assert run(f"a.html --loads {LOADS} --path worst --path-steps 8 --imperfection mode:20mm --report r.json") == 0
    figures = json.loads(Path("r.json").read_text())
    page = read("a.html")
    text = " ".join(page.text)
    assert "limit factor, nonlinear" in text and "Nonlinear path" in text and "of large displacements" in text
    assert f"with an imperfection (mode) of {1e3 * figures['path']['imperfection_max']:.3g} mm" in text
    assert len(page.addresses) == 3 + 1
    assert figures["limit_factor"] is None or f"{figures['limit_factor']:.3g}" in text


def test_a_picture_shows_the_members(place: Path) -> None:
    assert run(f"a.png --loads {LOADS}") == 0
    with Image.open("a.png") as image:
        assert image.size == (1500, 940) and len(image.convert("RGB").getcolors(2**24) or []) > 100


def test_timber_is_solved_and_reported_without_checks(place: Path) -> None:
    assert run(f"a.html a.pdf a.png --loads {LOADS} --section R100x200 --material GL24h") == 0
    text = " ".join(read("a.html").text)
    assert "no member is checked: GL24h R100x200 is not steel" in text and "6.3.1" not in text


def test_the_weight_curve_is_in_the_report(place: Path) -> None:
    assert run(f"a.json --loads {LOADS} --size 3 --report r.json") == 0
    figures = json.loads(Path("r.json").read_text())
    rounds, masses = figures["sizing_rounds"], figures["mass_by_sections"]
    assert rounds[-1]["mass"] == pytest.approx(figures["mass"]) == pytest.approx(masses["3"])
    assert rounds[-1]["utilization"] == pytest.approx(figures["utilization_max"]) and rounds[-1]["buckling"] >= 10
    assert [each["mass"] for each in rounds] == sorted(each["mass"] for each in rounds)
    assert list(masses) == ["1", "2", "3"]


def test_loads_and_supports_are_said_in_words() -> None:
    words = {
        "self": "self-weight",
        "cladding:0.5kN/m2": "cladding 0.5 kN/m2 on the surface",
        "snow:1e3Pa": "snow 1e3 Pa on the area in plan",
        "half-snow:1kN/m2@30": "snow 1 kN/m2 on half of the area in plan, towards 30 degrees from x",
        "wind:0.8kN/m2:-0.7": "wind 0.8 kN/m2, coefficient -0.7 on the surface",
        "wind:0.8kN/m2:0.8/-0.5@90": "wind 0.8 kN/m2 towards 90 degrees from x, coefficients 0.8 on what faces it and -0.5 on the rest",
        "temperature:-30K": "change of temperature -30 K",
    }
    assert {load: load_words(load) for load in words} == words
    assert load_words({"case": "lamp", "force": [0, 0, "-2kN"]}) == "lamp"
    assert load_words({"case": "drift", "load": "snow:2kN/m2"}) == "drift (snow 2 kN/m2 on the area in plan)"
    assert (
        supports_in_words("loop:1+lowest:0.6+N007") == "boundary loop 1 and nodes up to 0.6 m above the lowest and N007"
    )
    assert supports_in_words("corners+line:rim") == "corners of the boundary and line rim"
    assert [fixed(value, 1) for value in (-0.01, 0.0, -1234.56)] == ["0.0", "0.0", "-1,234.6"]


def test_what_no_clause_checks_is_listed_by_its_stress() -> None:
    grid = dome(5, 40.0)
    truss = st.Truss.from_grid(
        grid, scale=50, unit="mm", section="R100x200", material="GL24h", supports="boundary", loads=LOADS
    )
    solution = st.solve(truss)
    stresses, causes = greatest_stresses(solution)
    for member in (0, int(stresses.argmax())):
        every = {
            each.name: np.abs(each.stresses[member]).sum() for each in solution.all_results() if each.state == "ULS"
        }
        assert causes[member] == max(every, key=lambda name: every[name])
        assert stresses[member] == pytest.approx(max(every.values()))
    parts = report_parts(
        ReportSource("dome", "", StructureSettings(supports="boundary"), solution, report_structure(solution))
    )
    listed = next(part for part in parts if isinstance(part, DataTable) and "axial stress [MPa]" in part.head)
    assert listed.rows[0][0] == truss.member_marks[int(stresses.argmax())] and len(listed.rows) == 20
