"""Replacement for scipy.sparse where SciPy is not installed, such as in Blender."""

import numpy as np


class csr_array:
    """The part of scipy.sparse.csr_array that weights need."""

    def __init__(self, parts, shape):
        self.data, self.indices, self.indptr = parts
        self.shape = shape

    def tocsr(self):
        return self

    def toarray(self):
        dense = np.zeros(self.shape, self.data.dtype)
        dense[np.repeat(np.arange(self.shape[0]), np.diff(self.indptr)), self.indices] = self.data
        return dense

    def __matmul__(self, other):
        return self.toarray() @ other
