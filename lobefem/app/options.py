"""What options of the command line are made of, and how commands share them."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any, get_type_hints

import typer

__all__ = ["Group", "Text", "flag", "option", "sharing"]

Text = str | None

Group = dict[str, tuple[Any, Any]]  # by parameter: its annotation and its default


def option(name: str, metavar: str, help: str, panel: str = "Override the design") -> Any:  # noqa: A002
    """An option with a value, in a panel of the help."""
    text = _plain(help)
    return typer.Option(name, metavar=metavar, help=text, show_default=False, rich_help_panel=panel)


def flag(name: str, help: str, panel: str) -> Any:  # noqa: A002
    """An option without a value, in a panel of the help."""
    return typer.Option(name, help=_plain(help), rich_help_panel=panel)


def _plain(help: str) -> str:  # noqa: A002
    """A help text whose brackets Rich does not take for markup and leave out."""
    return help.replace("[", "\\[")


def sharing(first: Group, last: Group) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command the options that many share; it finds their values in its context's `params`.

    Args:
        first: those between its design file and its own options.
        last: those after its own options.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        hints = get_type_hints(command, include_extras=True)
        own = inspect.signature(command).parameters

        @wraps(command)
        def shared(**given: Any) -> Any:
            return command(**{name: given[name] for name in own})

        def parameter(name: str, annotation: Any, default: Any) -> inspect.Parameter:
            return inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
            )

        mine = [parameter(name, hints[name], one.default) for name, one in own.items()]
        before, after = ([parameter(name, *one) for name, one in group.items()] for group in (first, last))
        parameters = [*mine[:2], *before, *mine[2:], *after]
        shared.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        shared.__annotations__ = {one.name: one.annotation for one in parameters}
        return shared

    return decorate
