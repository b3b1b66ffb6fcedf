"""Properties of the structures of files, of any kind."""

from __future__ import annotations

from typing import Final

from rockframe.results.schema.declare import Variable, optional

# fmt: off
#: Properties of each structure; NaN for kinds without them.
OF_FRAME: Final = (
    Variable("height", "structure", float, "m", "height of a column", "frame", valid="finite or absent"),
    Variable("width", "structure", float, "m", "width of a column", "frame", valid="finite or absent"),
    Variable("top_contact_width", "structure", float, "m", "width at the top of a column, on which the beam rests", "frame", valid="finite or absent"),
    Variable("centre_height", "structure", float, "m", "height of a column's centre of gravity above its base", "frame", valid="finite or absent"),
    Variable("inertia_ratio", "structure", float, "1", "I_o / (m_c R^2) of a column about its base corner", "frame", valid="finite or absent"),
    Variable("slenderness", "structure", float, "rad", "slenderness, alpha; for columns that are not prismatic, the slenderness of the equivalent column", "frame", valid="finite or absent"),
    Variable("size", "structure", float, "m", "distance from the pivot of a column to its centre of gravity, R", "frame", valid="finite or absent"),
    Variable("mass_ratio", "structure", float, "1", "mass of the beam over that of all columns", "frame", valid="finite or absent"),
    Variable("frequency_parameter", "structure", float, "rad s-1", "frequency parameter of a column, p", "frame", valid="finite or absent"),
    Variable("effective_frequency_parameter", "structure", float, "rad s-1", "frequency parameter of the frame, p-hat", "frame", valid="finite or absent"),
    Variable("restitution", "structure", float, "1", "angular velocity after an impact over angular velocity before, sqrt(r)", "frame", valid="finite or absent"),
    Variable("uplift_acceleration", "structure", float, "m s-2", "ground acceleration that starts uplift", "frame", valid="finite or absent"),
)

#: Kinds of the structures of a file, if it has others than rocking frames, and their properties.
KINDS_OF_STRUCTURES: Final = optional("kinds",
    Variable("kind", "structure", str, "1", "kind of the structure"),
    Variable("parameter", "parameter", str, "1", "property of a structure that is no rocking frame", key=True),
    Variable("parameter_units", "parameter", str, "1", "unit of the property"),
    Variable("parameter_label", "parameter", str, "1", "description of the property"),
    Variable("parameter_value", "structure parameter", float, "1", "value of the property, in parameter_units", comment="NaN for structures without it"),
)

#: What turns forces over the weight into newtons, and the friction that shear keys need not carry.
OF_WEIGHT: Final = optional("weight",
    Variable("weight", "structure", float, "N", "weight of a column with its share of the beam", "frame", comment="NaN if the mass is not stated"),
    Variable("friction_coefficient", "structure", float, "1", "coefficient of friction available at the joints", "frame", comment="NaN if it is not stated"),
)

#: Values of frames before their edges crush; OF_FRAME has the values after crushing.
OF_CRUSHING: Final = optional("crushing",
    Variable("slenderness_before_crushing", "structure", float, "rad", "slenderness before the edges crush", "before_crushing.slenderness", comment="NaN where edges do not crush"),
    Variable("restitution_before_crushing", "structure", float, "1", "restitution, sqrt(r), before the edges crush", "before_crushing.restitution", comment="NaN if edges do not crush; smaller than the restitution after crushing, because columns on closer pivots lose less"),
)
# fmt: on
