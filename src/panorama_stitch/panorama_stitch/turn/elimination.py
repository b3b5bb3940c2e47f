"""Normal equations of a few unknowns that all share, and of many landmarks that share nothing."""

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix


class Elimination:
    """Landmarks eliminated from normal equations (the Schur complement of their part).

    No sighting is of two landmarks: their part of the equations is made of 3 x 3 blocks, which are
    inverted one by one. SciPy's iterative solver creeps along the valley in which focal lengths
    and places off the axis make up for each other; the exact step does not.

    Attributes
    ----------
    reduced : ndarray
        (count, count), what is left of the equations for the shared unknowns.

    References
    ----------
    Triggs et al., "Bundle adjustment - a modern synthesis", 2000, doi 10.1007/3-540-44480-7_21.
    """

    def __init__(self, information: csr_matrix, count: int):
        """Eliminate.

        Parameters
        ----------
        information
            (N, N), first the `count` shared unknowns, then three of each landmark.
        count
            Of the shared unknowns.
        """
        self._count = count
        self._shared = information[:count, count:].toarray()
        blocks = information[count:, count:].tobsr((3, 3))
        inverse = np.linalg.inv(blocks.data)
        self._inverse = bsr_matrix((inverse, blocks.indices, blocks.indptr))
        self.reduced = information[:count, :count].toarray()
        self.reduced -= self._shared @ (self._inverse @ self._shared.T)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return the unknowns (N,) for which the equations have this right side (N,)."""
        alone = self._inverse @ right[self._count :]
        shared = np.linalg.solve(self.reduced, right[: self._count] - self._shared @ alone)
        return np.concatenate([shared, alone - self._inverse @ (self._shared.T @ shared)])
