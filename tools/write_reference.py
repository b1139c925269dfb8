"""Print the page docs/reference.md from what ./mics says of its case files; see `make reference`."""

import json
import subprocess
from pathlib import Path

_PROGRAM = Path(__file__).resolve().parents[1] / "mics"
_HEAD = """\
# The case file: every group and variable

Written by `make reference` from the lines of `src/case` that read and check a case; do not edit.
`./mics --help GROUP` prints the same. `docs/mics-case.schema.json` holds it as a JSON schema: the
page of `mics-tools report` takes the defaults from it, and Python checks a case by it with the
packages f90nml and jsonschema:

```python
import json, f90nml, jsonschema
case = f90nml.read('input/blocks.nml')
case = {k: [dict(g) for g in v] if isinstance(v, list) else dict(v)
        for k, v in case.items()}
jsonschema.validate(case, json.load(open('docs/mics-case.schema.json')))
```

SI units; angles in degrees where a name ends in `_deg`.
"""
_TABLE = """
## &{group}

{meaning}.

| variable | values | default | unit | meaning | example |
|---|---|---|---|---|---|
"""


def ask(topic: str) -> str:
    """What the program prints about a topic."""
    return subprocess.run(
        [_PROGRAM, f"--help={topic}"], capture_output=True, text=True, check=True
    ).stdout


def page() -> str:
    """The page, with a table for each group."""
    schema, text = json.loads(ask("json")), _HEAD
    for group, about in schema["$defs"].items():
        meaning = about["description"][0].upper() + about["description"][1:]
        if "anyOf" in schema["properties"][group]:
            meaning += "; a case may hold any number of these groups"
        text += _TABLE.format(group=group, meaning=meaning)
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
    print(page(), end="")
