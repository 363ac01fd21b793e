"""The common problem in NGSolve: python film_ngsolve.py, data.npz in this folder, leaves result.npz."""

import numpy as np
from netgen.meshing import FaceDescriptor
from netgen.meshing import Mesh as NetgenMesh
from ngsolve import *
from ngsolve.solvers import NewtonMinimization

data = np.load("data.npz")
p, stiffness, nu, share = (float(data[name]) for name in ("pressure", "stiffness", "nu", "share"))

netgen = NetgenMesh(dim=3)
netgen.AddPoints(data["points"])
netgen.Add(FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
netgen.AddElements(dim=2, index=1, data=data["triangles"].astype(np.int32), base=0)
mesh = Mesh(netgen)
V = VectorH1(mesh, order=1)
u = V.TrialFunction()
H = Grad(u).Trace()  # displacement gradient along the surface
n = specialcf.normal(3)
P = Id(3) - OuterProduct(n, n)
strain = 0.5 * (P * H + H.trans * P + H.trans * H)

trace, square = Trace(strain), InnerProduct(strain, strain)
isotropic = stiffness / (2 * (1 - nu**2)) * ((1 - nu) * square + nu * trace**2)
energy = isotropic
if data["wrinkles"]:
    mean, radius2 = trace / 2, square / 2 - trace**2 / 4
    taut = IfPos(mean, (1 + nu) ** 2 * mean**2 - (1 - nu) ** 2 * radius2, -1)
    major = mean + sqrt(IfPos(taut, 1.0, radius2))
    wrinkled = IfPos(major, stiffness / 2 * major**2, 0.0)
    energy = (1 - share) * IfPos(taut, isotropic, wrinkled) + share * isotropic
volume = InnerProduct(CF((x, y, z)) + u, Cof(Id(3) + H) * n) / 3
a = BilinearForm(V, symmetric=True)
a += Variation((energy - p * volume).Compile() * ds)

displacement = GridFunction(V)
values = displacement.vec.FV().NumPy()  # all x, all y, all z
values[:] = data["start"].T.ravel()
free = BitArray(V.ndof)
free.Set()
for node in data["held"]:
    for component in range(3):
        free.Clear(int(component * mesh.nv + node))
converged, iterations = NewtonMinimization(
    a,
    displacement,
    freedofs=free,
    inverse="sparsecholesky",
    maxerr=1e-8,
    maxit=60,
    linesearch=True,
    printing=False,
)
np.savez("result.npz", displacement=values.reshape(3, -1).T, iterations=iterations)
