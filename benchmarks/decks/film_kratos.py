"""The common problem in Kratos: python film_kratos.py, data.npz in this folder, leaves result.npz."""

import KratosMultiphysics as KM
import KratosMultiphysics.ConstitutiveLawsApplication
import KratosMultiphysics.LinearSolversApplication
import numpy as np
from KratosMultiphysics import python_linear_solver_factory
from KratosMultiphysics.StructuralMechanicsApplication import POINT_LOAD, SURFACE_LOAD

data = np.load("data.npz")
p, stiffness, nu, share = (float(data[name]) for name in ("pressure", "stiffness", "nu", "share"))
thickness = 5e-5

model = KM.Model()
film = model.CreateModelPart("film", 2)
film.ProcessInfo[KM.DOMAIN_SIZE] = 3
for variable in (KM.DISPLACEMENT, KM.REACTION, KM.VOLUME_ACCELERATION, POINT_LOAD):
    film.AddNodalSolutionStepVariable(variable)
for variable in (KM.POSITIVE_FACE_PRESSURE, KM.NEGATIVE_FACE_PRESSURE, SURFACE_LOAD):
    film.AddNodalSolutionStepVariable(variable)
for k, point in enumerate(data["points"].tolist(), 1):
    film.CreateNewNode(k, *point)


def material(number, name, part):
    """A film of this law with this part of the stiffness."""
    properties = film.CreateNewProperties(number)
    properties.SetValue(KM.YOUNG_MODULUS, part * stiffness / thickness)
    properties.SetValue(KM.POISSON_RATIO, nu)
    properties.SetValue(KM.THICKNESS, thickness)
    properties.SetValue(KM.DENSITY, 0.0)
    properties.SetValue(KM.CONSTITUTIVE_LAW, KM.KratosGlobals.GetConstitutiveLaw(name).Clone())
    return properties


# the blended energy: elements of both laws, one upon the other
isotropic = material(1, "LinearElasticPlaneStress2DLaw", share if data["wrinkles"] else 1.0)
layers = [isotropic]
if data["wrinkles"]:
    wrinkling = material(2, "WrinklingLinear2DLaw", 1 - share)
    inner = KM.KratosGlobals.GetConstitutiveLaw("LinearElasticPlaneStress2DLaw").Clone()
    sub = film.CreateNewProperties(3)
    for variable in (KM.YOUNG_MODULUS, KM.POISSON_RATIO, KM.THICKNESS, KM.DENSITY):
        sub.SetValue(variable, wrinkling.GetValue(variable))
    sub.SetValue(KM.CONSTITUTIVE_LAW, inner)
    wrinkling.AddSubProperties(sub)
    layers.append(wrinkling)
triangles = (data["triangles"] + 1).tolist()
count = 0
for properties in layers:
    for nodes in triangles:
        count += 1
        film.CreateNewElement("MembraneElement3D3N", count, nodes, properties)
for k, nodes in enumerate(triangles, 1):
    film.CreateNewCondition("SurfaceLoadCondition3D3N", k, nodes, isotropic)

KM.VariableUtils().AddDof(KM.DISPLACEMENT_X, KM.REACTION_X, film)
KM.VariableUtils().AddDof(KM.DISPLACEMENT_Y, KM.REACTION_Y, film)
KM.VariableUtils().AddDof(KM.DISPLACEMENT_Z, KM.REACTION_Z, film)
for node, start in zip(film.Nodes, data["start"].tolist(), strict=True):
    node.SetSolutionStepValue(KM.DISPLACEMENT, start)
    node.SetSolutionStepValue(KM.NEGATIVE_FACE_PRESSURE, p)
for k in data["held"].tolist():
    for variable in (KM.DISPLACEMENT_X, KM.DISPLACEMENT_Y, KM.DISPLACEMENT_Z):
        film.Nodes[k + 1].Fix(variable)
KM.VariableUtils().UpdateCurrentToInitialConfiguration(film.Nodes)
film.ProcessInfo[KM.DELTA_TIME] = 1.0
film.CloneTimeStep(1.0)

solver = python_linear_solver_factory.ConstructSolver(
    KM.Parameters('{"solver_type": "LinearSolversApplication.sparse_lu"}')
)
strategy = KM.ResidualBasedNewtonRaphsonStrategy(
    film,
    KM.ResidualBasedIncrementalUpdateStaticScheme(),
    KM.ResidualCriteria(1e-8, 1e-12),
    KM.ResidualBasedBlockBuilderAndSolver(solver),
    200,
    False,
    False,
    True,
)
strategy.SetEchoLevel(0)
strategy.Initialize()
strategy.Check()
strategy.Solve()
displacement = [node.GetSolutionStepValue(KM.DISPLACEMENT) for node in film.Nodes]
iterations = film.ProcessInfo[KM.NL_ITERATION_NUMBER]
np.savez("result.npz", displacement=np.array([list(u) for u in displacement]), iterations=iterations)
