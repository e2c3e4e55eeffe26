"""Several bodies that touch, put together piece by piece."""

from typing import Any, get_args

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.core.tables import located
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.contact_patches import Count
from fecontact.fem.pairing import Pairing, TwoPassPairing, pair_both_faces, pair_faces
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.ground.sliding import Sliding
from fecontact.reduction.assembly.links import Link
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.reduce_body import reduce_bodies
from fecontact.system.contact_system import ContactSystem
from fecontact.system.gap import Gap
from fecontact.system.interfaces import Interface


class Assembly:
    """Bodies, the faces at which they touch, and what joins them; their contact system.

    The short way to :func:`fecontact.reduction.reduce_bodies`, :func:`fecontact.fem.pair_faces`,
    :class:`fecontact.Interface` and ``ContactSystem(bodies=, interfaces=, links=)``, which stays
    open for what it does not say.

    Attributes
    ----------
    bodies : dict of str to ElasticBody
    interfaces : dict of str to Interface
    links : dict of str to link
        By name; without one ``link_1`` and on.

    Examples
    --------
    A block of steel on a longer one, pressed by 100 N:

    >>> import numpy as np
    >>> import fecontact as fc
    >>> from fecontact.laws import ConstantFriction, LinearContact
    >>> lower = fc.Mesh.grid(np.linspace(0.0, 0.1, 11), np.linspace(0.0, 0.02, 3))
    >>> upper = fc.Mesh.grid(np.linspace(0.03, 0.07, 5), np.linspace(0.02, 0.04, 3))
    >>> model = fc.Assembly()
    >>> model.add("table", fc.ElasticBody(lower, fixed={"bottom": "xy"}), modes=4)
    >>> model.add("block", fc.ElasticBody(upper), modes=6, C="top left")
    >>> model.contact("joint", "block.bottom", "table.top", normal=LinearContact(1e8),
    ...               friction=ConstantFriction(0.3, smoothing_slope=1e4))
    >>> system = model.system(load=fc.Load(normal=100.0))
    >>> rest = fc.equilibrium(system, "rest")
    >>> print(f"{rest.normal_force.sum():.1f} N")
    100.0 N
    """

    def __init__(self) -> None:
        self.bodies: dict[str, ElasticBody] = {}
        self.interfaces: dict[str, Interface] = {}
        self.links: dict[str, Link] = {}
        self._options: dict[str, dict[str, Any]] = {}

    def add(self, name: str, body: ElasticBody, **options: Any) -> None:
        """Add a body, where it is assembled.

        Parameters
        ----------
        name : str
            Its faces are ``NAME.BOUNDARY``, its points ``NAME.POINT``.
        body : ElasticBody
            Not reduced yet.
        **options : Any
            Of :func:`fecontact.modal_basis` for this body, such as ``modes``, ``damping``,
            ``points``.

        Raises
        ------
        InputError
            If the name is taken.
        """
        require_kind("Assembly.add", ElasticBody, body=body)
        _require_free("body", name, self.bodies)
        self.bodies[name], self._options[name] = body, options

    def contact(
        self, name: str, face: str, other: str, *, normal: NormalLaw,
        friction: FrictionLaw | None = None, sliding: Sliding | None = None, gap: Gap = 0.0,
        nodes: Count = "all", both_faces: bool = False, reach: float | None = None,
        overlap: float = 0.01,
    ) -> None:
        """Let two faces touch, or a face and the ground.

        Parameters
        ----------
        name : str
            Name of the interface; its laws are ``interfaces.NAME.normal`` and ``.friction``.
        face, other : str
            ``BODY.BOUNDARY`` of bodies that were added; ``other`` may be ``"ground"``.
        normal, friction, sliding, gap
            See :class:`fecontact.Interface`.
        nodes, reach, overlap
            See :func:`fecontact.fem.pair_faces`. Contact nodes are on the finer face, or on
            ``face`` if the other one slides.
        both_faces : bool
            Contact nodes on both faces, see :func:`fecontact.fem.pair_both_faces`.

        Raises
        ------
        InputError, MeshError
            If the name is taken, and as these.
        """
        require_kind("Assembly.contact", bool, both_faces=both_faces)
        _require_free("interface", name, self.interfaces)
        found: Pairing | TwoPassPairing
        with located(f"Interface '{name}':"):
            if both_faces:
                found = pair_both_faces(self.bodies, face, other, nodes=nodes, reach=reach,
                                        overlap=overlap)
            else:
                found = pair_faces(self.bodies, face, other, nodes=nodes, reach=reach,
                                   overlap=overlap,
                                   nodes_on="finer" if sliding is None else "face")
        self.interfaces[name] = Interface(name, found, normal, friction, sliding, gap)

    def join(self, link: Link, name: str | None = None) -> None:
        """Join points by a weld, hinge, bushing or spring; see :mod:`fecontact.reduction`.

        Raises
        ------
        InputError
            If the name is taken, or for what is no link.
        """
        require_kind("Assembly.join", get_args(Link), link=link)
        name = f"link_{len(self.links) + 1}" if name is None else name
        _require_free("link", name, self.links)
        self.links[name] = link

    def bases(self, **options: Any) -> dict[str, ModalBasis]:
        """Modal bases of all bodies; ``options`` are common ones of those without their own.

        Raises
        ------
        InputError, MeshError
            As :func:`fecontact.reduction.reduce_bodies`.
        """
        if not self.bodies:
            raise InputError("Assembly: there are no bodies; add some by Assembly.add.")
        counts = {name: own.get("modes", options.get("modes", 20))
                  for name, own in self._options.items()}
        each = {name: {key: value for key, value in own.items() if key != "modes"}
                for name, own in self._options.items()}
        common = {key: value for key, value in options.items() if key != "modes"}
        return reduce_bodies(self.bodies, [one.pairing for one in self.interfaces.values()
                                           if isinstance(one.pairing, Pairing | TwoPassPairing)],
                             self.links, modes=counts, each=each, **common)

    def system(self, **options: Any) -> ContactSystem:
        """The contact system of all.

        Parameters
        ----------
        **options : Any
            ``drive``, ``load`` and ``ground`` of :class:`fecontact.ContactSystem`; all others are
            common ones of :func:`fecontact.modal_basis`, such as ``modes`` and ``damping``.

        Raises
        ------
        InputError, MeshError
            As :meth:`bases` and :class:`fecontact.ContactSystem`.
        """
        of_system = {key: options.pop(key) for key in ("drive", "load", "ground")
                     if key in options}
        return ContactSystem(bodies=self.bases(**options), links=self.links,
                             interfaces=[*self.interfaces.values()], **of_system)

    def __repr__(self) -> str:
        return (f"<Assembly bodies: {choices(self.bodies) or 'none'}; interfaces: "
                f"{choices(self.interfaces) or 'none'}; links: {choices(self.links) or 'none'}>")


def _require_free(what: str, name: str, taken: dict[str, Any]) -> None:
    require_kind("Assembly", str, name=name)
    if name in taken:
        raise InputError(f"Assembly: '{name}' is the name of another {what}; give each its own.")
