//! Nothing of its own: building it builds the shared library of its dependency.
