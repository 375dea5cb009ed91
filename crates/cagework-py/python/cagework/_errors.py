"""What cagework raises, with the core's sentences. A file that is not there is an OSError, Ctrl-C a KeyboardInterrupt."""


class Error(Exception):
    """All errors of cagework."""


class ArrayError(Error, ValueError):
    """An array of another type or shape than is needed; the message names both."""


class OptionError(Error, ValueError):
    """An option out of range."""


class CageError(Error, ValueError):
    """A mesh that is no cage, or a model for which none can be made."""


class BindError(Error):
    """A bind that failed: no point inside the cage, more memory needed than allowed."""


class ModelError(Error):
    """A file that cannot be read as a model, or a model that cannot be written."""


class PullError(Error):
    """Nothing that can be pulled."""
