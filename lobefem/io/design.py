"""The design file: TOML in, a validated `Design` out, and from there the surface and the balloon.

Sections [shape], [mesh], [film], [hoops], [plates], [pressure], and of pumpkins [tendons], [fittings]
and [cleft].
Every key of a stack has the paper's value as its default, but without a table [hoops] there are no hoops.
A design on a mesh of one's own may have [supports], and any number of [[fixed]] and [[cables]].
Numbers are SI, or text with a unit ("0.05 mm"). Whatever is wrong is said in one sentence: the key, the
value, what to try.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_args

from pydantic import ValidationError, model_validator

from lobefem.errors import InputError
from lobefem.io import mesh_design, pumpkin_design
from lobefem.io.design_sections import Cap
from lobefem.io.design_tables import Tables
from lobefem.io.design_values import fill, listed, nearest
from lobefem.io.toml import read_toml, to_toml
from lobefem.typing import Comm
from lobefem.units import LENGTH, shown

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon
    from lobefem.geometry.surface import Surface
    from lobefem.model.film import Film as FilmLaw
    from lobefem.typing import Convention, Support

__all__ = ["Design"]

_MISSING = {
    "on": 'give the name of an edge group of the mesh, e.g. "rim"',
    "EA": 'give the stiffness of the cable in newtons, e.g. "20 kN"',
}

_SLACK = {
    "isotropic": 0.0,
    "orthotropic": 0.0,
    "fixed-wrinkles": 0.0,
    "tension-field": 1e-6,
    "imp": 1e-6,
    "load-path": 1e-6,
}


# keys that a change of another one makes void: both say the same thing
_REPLACED = {
    "film.material": ("E", "nu", "strength"),
    "hoops.EA": ("E", "area", "material"),
    "hoops.E": ("EA", "material"),
    "hoops.area": ("EA",),
    "hoops.material": ("EA", "E"),
}


class Design(Tables):
    """A balloon as its design file describes it, checked and complete.

    Read one with `Design.load`, change it with `with_overrides`, and build from it with `surface`
    and `balloon`.
    """

    @model_validator(mode="after")
    def _complete(self) -> Design:
        lobed = self.has_ideal_state
        if self.is_pumpkin:
            pumpkin_design.complete(self)
        else:
            pumpkin_design.refuse(self)
        film = self.film.model_copy()  # it may be part of another design
        size = self.size
        if self.shape.kind == "mesh":
            mesh_design.complete(self, film)
        else:
            mesh_design.require_none(self)
        if 0 < 0.01 * size < film.thickness:
            raise ValueError(
                f"film.thickness = {film.thickness} m is no thin film on a radius of {size} m "
                f"(shape); {LENGTH.advice}"
            )
        if film.slack_stiffness is None:
            fill(film, "slack_stiffness", _SLACK[film.law])
        if film.prestress is None:
            fill(film, "prestress", lobed and (film.law == "fixed-wrinkles" or film.setup == "load-path"))
        elif film.prestress and not lobed:
            raise ValueError(
                f"film.prestress = true needs an isotensoid; leave it out for a {self.shape.kind}"
            )
        if film.setup == "load-path":
            self._check_path(lobed)
        fill(self, "film", film)
        return self

    def _check_path(self, lobed: bool) -> None:
        if not lobed:
            raise ValueError(
                f"film.setup = 'load-path' needs an isotensoid; leave it out for a {self.shape.kind}"
            )
        number = len(self.pressure.value)
        if number != 1:
            raise ValueError(
                f"film.setup = 'load-path' sets up the stress of one pressure, not of {number}; give one in "
                "[pressure], or leave it out"
            )
        if not self.pressure.value[0]:
            raise ValueError("film.setup = 'load-path' needs a pressure above 0; give one in [pressure]")

    # --- reading and writing --------------------------------------------------------------------

    @classmethod
    def parse(cls, tables: Mapping[str, Any], source: str = "") -> Design:
        """Check nested tables, as TOML gives them.

        Args:
            tables: sections and their keys.
            source: where they come from, for messages.

        Raises:
            InputError: the first thing that is wrong, in one sentence.
        """
        try:
            return cls.model_validate(dict(tables))
        except ValidationError as error:
            _, begin, text = _first_error(error)
            raise InputError((source and f"{source}: ") + begin + text) from None

    @classmethod
    def load(cls, path: str | Path, comm: Comm | None = None) -> Design:
        """Read a design file.

        Args:
            path: of a TOML file.
            comm: MPI communicator; rank 0 reads for all, so that all see the same file or the same
                error. Collective if given.

        Raises:
            InputError: a file that cannot be read, is not TOML or holds an impossible design.
        """
        tables: dict[str, Any] | None = None
        fault = ""
        if comm is None or comm.rank == 0:
            tables, _, fault = read_toml(
                Path(path), "design file", "lobefem new --list for some to start from"
            )
            if tables is not None:
                tables, fault = pumpkin_design.with_tables(tables, Path(path))
        if comm is not None:
            tables, fault = comm.bcast((tables, fault), root=0)
        if tables is None:
            raise InputError(fault)
        shape = tables.get("shape")
        if isinstance(shape, dict) and isinstance(shape.get("file"), str) and shape["file"]:
            shape["file"] = str(Path(path).parent.absolute() / shape["file"])
        return cls.parse(tables, str(path))

    def with_overrides(self, changes: Mapping[str, Any], names: Mapping[str, str] | None = None) -> Design:
        """A design with some keys changed, checked again as a whole; defaults follow the changes.

        A new size replaces the old one, however that was given; on a cylinder and on a formed lobe
        `shape.edge_radius` is the radius.

        Args:
            changes: values by "section.key"; those that are None change nothing.
            names: what messages call a key instead ("film.law": "--film").

        Raises:
            InputError: a change that leads to no sound design.
        """
        tables = self.model_dump(exclude_unset=True)
        given = {key: value for key, value in changes.items() if value is not None}
        for path, value in given.items():
            section, _, key = path.partition(".")
            table = tables.setdefault(section, {})
            if section == "shape" and key in ("edge_radius", "R0"):
                table.pop("edge_radius", None)
                table.pop("R0", None)
                key = "radius" if table.get("kind") in ("cylinder", "formed") else key
            if path in ("mesh.divisions", "mesh.size"):
                table.pop("size" if key == "divisions" else "divisions", None)
                table["layout"] = "structured" if key == "divisions" else "unstructured"
            for other in _REPLACED.get(path, ()):
                if f"{section}.{other}" not in given:
                    table.pop(other, None)
            table[key] = value
        try:
            return Design.model_validate(tables)
        except ValidationError as error:
            path, begin, text = _first_error(error)
            called = (names or {}).get("shape.edge_radius" if path == "shape.radius" else path)
            raise InputError((f"{called}: " if called else begin) + text) from None

    def to_toml(self) -> str:
        """The design as TOML with all defaults filled in; `load` of it gives an equal design."""
        return to_toml(self.model_dump(exclude=None if self.is_pumpkin else {"tendons", "fittings", "cleft"}))

    # --- building -------------------------------------------------------------------------------

    def surface(self, comm: Comm | None = None, *, sector: bool = False) -> Surface:
        """The meshed film; for a formed lobe after its form was found. Collective.

        A form is found on a cylinder with the mesh of one lobe as designed, or with the default mesh
        where that is unstructured.

        Args:
            comm: MPI communicator (default: all ranks).
            sector: one of its equal sectors only, whole on every rank.

        Raises:
            InputError: a mesh that cannot be made, or a film that would bulge over its rims.
            SolveError: Gmsh failed, or no form was found.
        """
        import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

        # isort: split
        from lobefem.geometry.isotensoid import Isotensoid
        from lobefem.geometry.stacks import cylinder, lobed_cylinder

        from mpi4py import MPI

        shape, mesh = self.shape, self.mesh
        if self.is_pumpkin:
            return pumpkin_design.surface(self, comm, sector)
        if shape.kind == "mesh":
            if sector:
                raise InputError(
                    "no sector of a mesh of one's own stands for all; look at lobefem modes --state inflated"
                )
            return mesh_design.read(self, MPI.COMM_WORLD if comm is None else comm)
        how: dict[str, Any] = {
            "divisions": mesh.divisions or (24, 32),
            "cell": mesh.cell,
            "order": mesh.order,
            "diagonals": mesh.diagonals,
            "grading": mesh.grading,
            "layout": mesh.layout,
            "size": mesh.size,
            "sector": sector,
            "comm": MPI.COMM_WORLD if comm is None else comm,
        }
        if shape.kind == "cylinder":
            assert shape.radius is not None
            assert shape.length is not None
            return cylinder(shape.radius, shape.length, **how)
        if shape.kind == "formed":
            assert shape.radius is not None
            assert shape.length is not None
            assert shape.forming_pressure is not None
            from lobefem.equilibrium.form_finding import (
                find_form,  # slow to import, and most lobes are not formed ones
            )

            even = {"sector": False, "grading": 0.0}  # the lobe's rows belong at equal steps of the cylinder
            drawn = how | even if mesh.layout == "structured" else {"comm": how["comm"]}
            film = cylinder(shape.radius, shape.length, **drawn)
            form = find_form(film, shape.forming_pressure, Et=shape.forming_stiffness)
            return form.surface(shape.lobes, **how)
        assert shape.truncation is not None
        if shape.R0 is not None:
            lobe = Isotensoid(shape.R0, shape.truncation)
        else:
            assert shape.edge_radius is not None
            lobe = Isotensoid.from_edge_radius(shape.edge_radius, shape.truncation)
        return lobed_cylinder(shape.lobes, shape=lobe, **how)

    def balloon(self, surface: Surface, *, prestressed: bool | None = None, contact: bool = False) -> Balloon:
        """Film, load, hoops and plates on a surface. Collective.

        Args:
            surface: from `surface`.
            prestressed: whether the isotensoid's stress is built in (default: as designed).
            contact: whether film and plates touch each other rather than pass through.

        Raises:
            ConvergenceError: no equilibrium of the load path that is to set up the stress.
        """
        from lobefem.fem.balloon import Balloon
        from lobefem.model.cables import Hoops as Seams
        from lobefem.model.end_plates import EndPlates
        from lobefem.model.gas_pressure import GasPressure
        from lobefem.model.self_contact import SelfContact
        from lobefem.model.supports import Fixed, FreeBody

        film, plates, gas = self.film, self.plates, self.pressure
        # of a sealed gas, whose pressure changes on the way, the stiffness of its first one
        stiffness = max(*gas.value, 1.0) if gas.gas == "isothermal" else None
        touching = [SelfContact(stiffness=stiffness)] if contact else []
        if self.is_pumpkin:
            return pumpkin_design.balloon(self, surface, self._law(film.law), touching)
        components: list[Any] = [
            GasPressure(cast("Convention", gas.load), gradient=gas.gradient, level=gas.level)
        ]
        if self.hoops.enabled:
            components.append(Seams(EA=self.hoops.EA))
        if self.has_plates:
            components.append(
                EndPlates(support=cast("Support", plates.support), bar=plates.bar, lift=plates.lift)
            )
        components += mesh_design.cables_of(self, surface)
        components += [Fixed(part.on, tuple("xyz".index(c) for c in part.components)) for part in self.fixed]
        if self.supports.free:
            components.append(FreeBody())
        built_in = bool(film.prestress) if prestressed is None else prestressed
        path = None
        if built_in and film.setup == "load-path":
            from lobefem.equilibrium.inflation import inflate

            path = inflate(Balloon(surface, self._law("load-path"), components), self.pressure.value[0])
        return Balloon(
            surface,
            self._law(film.law),
            [*components, *touching],
            prestressed=built_in and path is None,
            hoop_slack=film.hoop_slack if built_in else 0.0,
            load_path=path,
        )

    def _law(self, law: str) -> FilmLaw:
        """The designed film with one of the laws."""
        from lobefem.model.laws import FILMS, STRESS_LAWS

        film = self.film
        if film.is_orthotropic:
            return pumpkin_design.orthotropic(film)
        material: dict[str, Any] = {"E": film.E, "nu": film.nu, "thickness": film.thickness}
        if law != "isotropic":
            share = film.slack_stiffness
            # a path needs a tangent in slack film whatever takes over
            material["slack_stiffness"] = share if law == film.law else share or _SLACK[law]
        if law == film.law and law in STRESS_LAWS:
            material["tangent"] = film.tangent
        return {**FILMS, **STRESS_LAWS}[law](**material)


def _first_error(error: ValidationError) -> tuple[str, str, str]:
    """Key path, how a sentence begins with it, and its rest; unknown keys before all others."""
    errors = error.errors(include_url=False)
    first = next((e for e in errors if e["type"] == "extra_forbidden"), errors[0])
    keys = [str(part) for part in first["loc"]]
    section = keys[0] if keys else ""
    several = section in ("fixed", "cables")
    if len(keys) > 1 and several:  # the one of several tables that is meant
        keys[:2] = [f"{section}[{keys[1]}]"]
    path = ".".join(keys)
    header = f"[[{section}]]" if several else f"[{section}]"
    if first["type"] == "missing":
        return path, f"{path} ", f"is missing; {_MISSING.get(keys[-1], 'give it')}"
    if first["type"] == "extra_forbidden":
        where: Any = Design if len(keys) == 1 else Design.model_fields[section].annotation
        known = tuple((get_args(where)[0] if several else where).model_fields)
        what = "section" if len(keys) == 1 else f"key of {header}"
        if len(keys) > 2:  # in a table of a list of them
            known, what = tuple(Cap.model_fields), f"key of [[{'.'.join(keys[:2])}]]"
        choice = f"is no {what}; use {listed(known)}{nearest(keys[-1], known)}"
        return path, f"{shown(path)} ", choice
    if first["type"] == "value_error":
        # what is wrong with a section as a whole begins with one of its keys
        begin = {0: "", 1: f"{path}."}.get(len(keys), f"{path}: ")
        return path, begin, str(first["ctx"]["error"])
    header = header if len(keys) == 1 else f"[{path}]"
    what = "list of tables; write [[film.caps]]" if keys[1:] == ["caps"] else f"table; write {header}"
    text = f"{shown(first['input'])} is not a {what} and its keys below"
    return path, f"{path}: ", text
