"""Tables of a design on a mesh of one's own: what holds it, and cables on its named edges."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, model_validator

from lobefem.io.design_sections import Section
from lobefem.io.design_values import flag, group_name, positive, quantity
from lobefem.typing import Unchecked
from lobefem.units import FORCE, LENGTH, NUMBER, shown

__all__ = ["CableTable", "FixedTable", "Supports", "one_or_more"]


def _components(value: Unchecked) -> str:
    if not isinstance(value, str) or not value or sorted(set(value) & set("xyz")) != sorted(value):
        raise ValueError(f'{shown(value)} are no components; give some of x, y and z, e.g. "xy"')
    return value


def one_or_more(value: Unchecked) -> Any:
    """A list of tables; one alone, [fixed], is a list of one."""
    return [value] if isinstance(value, Mapping) else value


class FixedTable(Section):
    """[[fixed]]: an edge group whose displacement is zero in the components named."""

    on: Annotated[str, BeforeValidator(group_name)]
    components: Annotated[str, BeforeValidator(_components)] = "xyz"


class CableTable(Section):
    """[[cables]]: a cable on an edge group, by its length at rest or by the share that it is shorter."""

    on: Annotated[str, BeforeValidator(group_name)]
    EA: Annotated[float, positive(FORCE)]
    rest_length: Annotated[float | None, positive(LENGTH)] = None
    foreshortening: Annotated[float, quantity(NUMBER, "in (-0.5, 0.5)", lambda v: -0.5 < v < 0.5)] = 0.0
    tension_only: Annotated[bool, BeforeValidator(flag)] = True

    @model_validator(mode="after")
    def _one_length(self) -> CableTable:
        if self.rest_length is not None and self.foreshortening:
            raise ValueError(
                f"rest_length = {self.rest_length} and foreshortening = {self.foreshortening} both give the "
                "length; leave one out"
            )
        return self


class Supports(Section):
    """[supports]: `free = true` for a closed body that nothing holds."""

    free: Annotated[bool | None, BeforeValidator(flag)] = None
