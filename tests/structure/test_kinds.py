"""A board and a campaign are told apart in one place of the commands: where a card is taken."""

from __future__ import annotations

import ast
from pathlib import Path

import bayesplate

COMMANDS = Path(bayesplate.__file__).parent / "commands"


def kinds_asked(source: str) -> set[str]:
    """Classes of campaigns that a source asks an object for by isinstance."""
    calls = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call))
    asked = (call.args[1] for call in calls if getattr(call.func, "id", "") == "isinstance")
    names = (part.id for one in asked for part in ast.walk(one) if isinstance(part, ast.Name))
    return {name for name in names if name.startswith("Campaign") and name != "CampaignCard"}


def test_only_by_kind_asks_whether_it_is_a_campaign():
    """The negative control: a branch elsewhere would be found."""
    asking = {path.name: found for path in COMMANDS.glob("*.py") if (found := kinds_asked(path.read_text("utf-8")))}
    branch = "if isinstance(summary, Summary | CampaignSummary) or isinstance(given, (Problem, Campaign)):\n    pass"

    assert asking == {"campaign.py": {"Campaign"}}
    assert kinds_asked(branch) == {"CampaignSummary", "Campaign"}
