"""`steelyard demo team`."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from steelyard.cli.console import STYLED, command_line, print_json, say, say_if_compiling, tell

if TYPE_CHECKING:
    from steelyard.logs.team_log import TeamLog
    from steelyard.report import Report
    from steelyard.simulate.three_omnids import ThreeOmnids
    from steelyard.team.estimate import TeamEstimate

TEAM = "team.toml"


def demo_team(seed: int, output: Path, keep: Path | None, as_json: bool) -> None:
    """Make a team's files, read them back, answer in two ways and compare with the truth."""
    say_if_compiling()
    from steelyard import api
    from steelyard.cli.versus import summary, versus_table
    from steelyard.io import read_team, result_dict, write_result, write_team
    from steelyard.report import write_report
    from steelyard.simulate.three_omnids import three_omnids, told
    from steelyard.tables.team import Known, team_table

    made = three_omnids(seed)
    with tempfile.TemporaryDirectory() as scratch:
        folder = keep or Path(scratch)
        written = write_team(made.log, folder / TEAM, made.joints, heading=told(made, seed))
        log = read_team(written)
        best, paper = api.identify_team(log), api.identify_team(log, "paper")
        write_result(best, folder / "result.json")
    truth = made.truth.body
    write_report(_page(log, best, paper, made, seed), output)
    if as_json:
        extra = {"truth": truth.vector.tolist(), "seed": seed, "report": str(output), "errors": _errors(best, made)}
        print_json(result_dict(best) | extra | {"paper": summary(paper, truth) | {"errors": _errors(paper, made)}})
        return
    known = Known(truth.people, made.grasps, made.late_s)
    tell(
        team_table(best, f"Three Omnids with one payload, one clock 13 ms late; made data (seed {seed})", known, STYLED)
    )
    tell("\n" + click.style("The same files in two ways", bold=True))
    tell(versus_table({"joint": best, "paper": paper}, truth))
    for name, found in (("joint", best), ("paper", paper)):
        off = _errors(found, made)
        tell(f"  {name:5}   grasps off by {off['position_mm']:.2f} mm and {off['rotation_deg']:.3f}° on average")
    say(f"The page with the payload in 3D: {output}")
    say(f"The files are in {keep}; try: {command_line('team', written)}" if keep else "Keep the files with --keep DIR.")


def _errors(found: TeamEstimate, made: ThreeOmnids) -> dict[str, Any]:
    """Return the mean errors of the grasps other than the reference."""
    gap, turn = found.away_from(made.grasps)
    return {"position_mm": gap, "rotation_deg": turn}


def _page(log: TeamLog, best: TeamEstimate, paper: TeamEstimate, made: ThreeOmnids, seed: int) -> Report:
    from steelyard.report.team_page import team_page

    return team_page(
        "One payload, three robots",
        best,
        log,
        rivals={"The paper's steps": paper},
        truth=(made.truth.body, made.grasps),
        provenance={"command": f"steelyard demo team --seed {seed}", "seed": str(seed)},
    )
