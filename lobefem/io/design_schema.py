"""The JSON schema of design files, from which editors complete keys and check values."""

from __future__ import annotations

import json
from typing import Any

from lobefem.io.design import Design

__all__ = ["design_schema"]


def design_schema() -> str:
    """The schema of design files as JSON, derived from the sections that read them.

    It knows keys, words and kinds of values; what does not go together is known to `Design` alone.
    """
    schema = Design.model_json_schema()
    schema["title"] = "lobefem design file"
    schema["description"] = "A lobed or pumpkin balloon: shape, mesh, film, plates or fittings, and pressure."
    told = {"$schema": "https://json-schema.org/draft/2020-12/schema"} | _plain(schema)
    return json.dumps(told, indent=1, ensure_ascii=False) + "\n"


def _plain(part: Any) -> Any:
    """A part of the schema without what TOML has not: null, and titles that repeat a key's name."""
    if isinstance(part, list):
        return [_plain(one) for one in part if one != {"type": "null"}]
    if not isinstance(part, dict):
        return part
    kept = {key: _plain(value) for key, value in part.items() if not (key == "default" and value is None)}
    if isinstance(kept.get("title"), str):  # a key may be called so, and then it is a table
        kept.pop("title")
    if isinstance(kept.get("description"), str):
        kept["description"] = " ".join(kept["description"].replace("`", "").split())
    if len(kept.get("anyOf", ())) == 1:
        kept |= kept.pop("anyOf")[0]
    return kept
