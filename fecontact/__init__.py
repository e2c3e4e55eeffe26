"""fecontact: elastic bodies in contact with friction.

Geometry, mesh, :class:`ElasticBody`, :class:`ModalBasis`, :class:`ContactSystem`,
:func:`simulate`, pictures: each of these takes what the one before it gives. Units are SI.
The public names stand in ``__init__.pyi``; each is loaded when it is first used.
"""

from fecontact.core.namespace import namespace

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = namespace(__name__, __file__)
