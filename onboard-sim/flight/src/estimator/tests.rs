//! Behaviour at the edges: bad input, silence, replay.
