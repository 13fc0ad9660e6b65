"""The page of verification: its table is current, and every figure is as near to its reference as it says."""

import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "verification.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def proofs() -> Iterator[list[Any]]:
    pytest.importorskip("Pynite")
    yield runpy.run_path(str(ROOT / "scripts" / "make_verification.py"))["proofs"]()


def test_every_proof_holds(proofs: list[Any]) -> None:
    assert len(proofs) > 30
    assert [(proof.what, proof.off) for proof in proofs if not proof.off <= proof.within] == []


def test_the_table_in_the_docs_is_current(proofs: list[Any]) -> None:
    rows = [line.split(" | ") for line in PAGE.partition("<!-- table -->")[2].splitlines() if line.count(" | ") == 4][
        2:
    ]
    assert len(rows) == len(proofs), "run scripts/make_verification.py"
    for (what, reference, theirs, ours, _), proof in zip(rows, proofs, strict=True):
        assert proof.what in what and reference == proof.reference
        assert (float(theirs), float(ours)) == pytest.approx((proof.theirs, proof.ours), rel=1e-4)
