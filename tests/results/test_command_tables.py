"""Tables of `check`, `compare` and `modes` from results made by hand, and which theory is said to be better."""

from __future__ import annotations

from dataclasses import replace

from bayesplate.campaign.summary import CampaignCheck
from bayesplate.commands.printout import show_campaign_check, show_check, show_modes
from bayesplate.results.checking import CheckedEffect, CheckedMode, CheckedSetup, CheckReport
from bayesplate.results.command_tables import check_tables, forward_table, methods_table, sheet_tables
from bayesplate.results.comparison import (
    SAME_CENTS,
    ComparedMode,
    ForwardPrediction,
    LeastSquaresErrors,
    MethodRow,
    ModulusEstimate,
    TheoryRow,
    better_theory,
)
from bayesplate.results.contract import Constants, Elastic, as_json
from bayesplate.results.sheets import EnergyShares, ModesReport, SheetReport, SheetRow

EFFECT = CheckedEffect("fluid_loading", {}, 44.1, 10.6, True, Elastic(-7.3, -2.4, 0.1), ("clamp_rotation", "tension"))
REPORT = CheckReport(
    name="made",
    title="",
    prior="spruce",
    law="exact",
    setups=(CheckedSetup("bench", {}, 1, 0, 0.3),),
    uncertain_inputs=(),
    estimate=Constants(13.05e9, 0.6743e9, 0.6064e9, 1.0, 2.0, 3.0),
    expected_sd_percent=Elastic(1.9, 4.2, 3.3),
    condition_number=3.0,
    modes=(CheckedMode("bench", "(1,0)", 52.0, 20.5, 0.62, (100.0, -0.2, 0.4), 0.99),),
    in_sample_rms_cents=20.5,
    signatures=(EFFECT, replace(EFFECT, effect="grain_angle", below_detection_limit=False, look_alikes=())),
    invisible="what cannot be seen",
    identifiability=("weak",),
    notes=("noted",),
    n_doubts=0,
)

NOTHING = ModulusEstimate(None, None, None, None, "Pa")
PAPER = ModulusEstimate(12.721e9, None, None, None, "Pa")
WEIGHTED = ModulusEstimate(13.05e9, 0.25e9, None, None, "Pa")
METHODS = (
    MethodRow("paper_least_squares", Elastic(PAPER, NOTHING, PAPER), 4.0, None,
              (ForwardPrediction("bench", "(1,0)", None, None),), None),
    MethodRow("percentile", Elastic(WEIGHTED, WEIGHTED, WEIGHTED), None, 42,
              (ForwardPrediction("bench", "(1,0)", 51.4, +20.5),), 20.5),
)  # fmt: skip
THIN = TheoryRow(
    "thin", (), {}, (), METHODS, (ComparedMode("bench", "(1,0)", 52.0, 20.5, 55.2),), LeastSquaresErrors(18.0, 38.0)
)


def test_check_shows_what_its_report_holds():
    constants, modes, effects = check_tables(REPORT)

    assert constants.texts[1] == ("E_y, across grain", "0.674", "± 4.2 %")
    assert modes.texts == (("(1,0)", "52", "+20.5", "100 / 0 / 0", "0.62"),)
    assert effects.texts == (
        ("fluid_loading", "44.1", "10.6 *", "-7.3/-2.4/+0.1", "clamp_rotation\ntension"),
        ("grain_angle", "44.1", "10.6  ", "-7.3/-2.4/+0.1", "–"),
    )
    assert len(check_tables(replace(REPORT, signatures=()))) == 2
    shown = show_check(REPORT)
    assert (shown.remarks, shown.warnings) == (("weak", "what cannot be seen"), ("noted",))
    assert shown.closing == "exact law; nothing was sampled. Next: bayesplate fit, with the same card and options"
    doubted = show_check(replace(REPORT, n_doubts=1)).closing
    assert doubted.endswith("Next: settle what is in doubt above; then bayesplate fit, with the same card and options")


def test_of_a_campaign_one_board_in_doubt_is_enough():
    for n_doubts, told in [(0, "Next: bayesplate fit"), (1, "Next: settle what is in doubt above")]:
        boards = {"first": REPORT, "second": replace(REPORT, n_doubts=n_doubts)}
        assert told in show_campaign_check(CampaignCheck("made", "", {}, None, boards)).closing


def test_methods_stand_beside_each_other():
    """A reading above what a method predicts is above the fit that has not seen it, too."""
    forward = forward_table(THIN)

    assert methods_table("made", THIN).texts == (
        ("paper", "12.72", "–", "12.72", "–"),
        ("percentile (42)", "13.05 ± 0.25", "13.05 ± 0.25", "13.05 ± 0.25", "20.5"),
    )
    assert forward.columns == ("mode", "Hz", "paper", "percentile", "left out")
    assert forward.texts == (("(1,0)", "52", "–", "+20.5", "+55.2"),)


BETTER = [
    (38.0 - 1.01 * SAME_CENTS, "shear-flexible", "lowers the error: 38.0 -> 37.5 cents"),
    (38.0 - 0.99 * SAME_CENTS, None, "changes nothing"),
    (38.0 + 0.99 * SAME_CENTS, None, "changes nothing"),
    (38.0 + 1.01 * SAME_CENTS, "thin", "raises the error: 38.0 -> 38.5 cents"),
    (None, None, "cannot be told apart"),
]


def test_the_better_theory_is_better_by_half_a_cent():
    assert SAME_CENTS == 0.5
    for left_out, better, words in BETTER:
        found = better_theory(THIN, replace(THIN, error=LeastSquaresErrors(17.0, left_out)))
        assert found.better == better, left_out
        assert words in found.sentence


def test_modes_are_shown_with_their_reading_or_their_range():
    rows = (
        SheetRow("(1,0)", 51.44, 52.0, -18.7, None, EnergyShares(100.0, -0.3, 0.3, 0.0), 3.232, -0.3164, 0.01128),
        SheetRow("(1,3)", 818.1, None, None, (800.4, 836.2), EnergyShares(2.0, 91.0, 7.0, 0.0), 16.92, 14340.0, 315.7),
    )
    report = ModesReport(
        "made", "", "at the estimate", (SheetReport("bench", {}, "thin", rows, ()),), (), (), ("m.png",)
    )
    (table,) = sheet_tables(report)

    assert table.columns[2:4] == ("measured or\nlikely Hz", "% in D_x/D_y/D_s")
    assert table.texts[0] == ("(1,0)", "51.4", "52", "100 / 0 / 0", "3.232", "-0.3164", "0.01128")
    assert table.texts[1][2] == "800 to 836"
    low = replace(report, setups=(replace(report.setups[0], modes=(replace(rows[1], likely_hz=(8.84, 9.13)),)),))
    assert sheet_tables(low)[0].texts[0][2] == "8.8 to 9.1"
    assert show_modes(report).closing == "Frequencies at the estimate; sheet to print: m.png"
    assert as_json(report)["setups"][0]["modes"][1]["likely_hz"] == [800.4, 836.2]


def test_results_show_themselves_in_a_line():
    assert repr(REPORT) == "<CheckReport of made: 1 modes, E_x ± 1.9 %, E_y ± 4.2 %, G_xy ± 3.3 % to expect>"
