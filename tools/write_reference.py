"""Write docs/reference.md anew below its head, from what ./mics says of its case files."""

import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference.md"
_HEAD = "| variable | values | default | unit | meaning | example |\n|---|---|---|---|---|---|\n"


def ask(topic: str) -> str:
    """What the program prints about a topic."""
    words = [ROOT / "mics", f"--help={topic}"]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def page() -> str:
    """The page, with a table for each group."""
    text, schema = PAGE.read_text().split("\n## &")[0], json.loads(ask("json"))
    for group, about in schema["$defs"].items():
        meaning = about["description"][0].upper() + about["description"][1:]
        if "anyOf" in schema["properties"][group]:
            meaning += "; a case may hold any number of these groups"
        text += f"\n## &{group}\n\n{meaning}.\n\n{_HEAD}"
        paragraphs = ask(group).split("\n\n")[1:]
        for (name, rule), said in zip(about["properties"].items(), paragraphs, strict=True):
            unit = rule.get("unit", "")
            meaning = rule["description"].removesuffix(f" [{unit}]")
            words, example = said.strip().rsplit("example: ", 1)
            words = " ".join(words.split()).removeprefix(name).removesuffix(meaning)
            values, default = words.strip().replace(f" [{unit}]", "").rsplit("; ", 1)
            if default.startswith("default "):
                default = f"`{default.removeprefix('default ')}`"
            text += f"| `{name}` | {values} | {default} | {unit} | {meaning} | `{example}` |\n"
    return text


if __name__ == "__main__":
    PAGE.write_text(page())
