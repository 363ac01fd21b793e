"""Mesh an airbeam with Gmsh: a tube along x with round ends. Writes airbeam.msh beside this file.

Physical groups carry the names that airbeam.toml uses: skin, root and tip.
"""

from pathlib import Path

import gmsh

RADIUS, LENGTH, SIZE = 0.1, 1.2, 0.05  # m

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
tube = occ.addCylinder(0, 0, 0, LENGTH, 0, 0, RADIUS)
ends = [occ.addSphere(x, 0, 0, RADIUS) for x in (0, LENGTH)]
occ.fuse([(3, tube)], [(3, end) for end in ends])
occ.synchronize()

gmsh.model.addPhysicalGroup(2, [face for _, face in gmsh.model.getEntities(2)], name="skin")
for name, x in (("root", 0), ("tip", LENGTH)):
    near = gmsh.model.getEntitiesInBoundingBox(x - 1e-3, -1, -1, x + 1e-3, 1, 1, dim=1)
    gmsh.model.addPhysicalGroup(1, [curve for _, curve in near], name=name)

gmsh.option.setNumber("Mesh.MeshSizeMax", SIZE)
gmsh.model.mesh.generate(2)
gmsh.write(str(Path(__file__).with_suffix(".msh")))
gmsh.finalize()
