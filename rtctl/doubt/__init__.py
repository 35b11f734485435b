"""Whether a device is still its model: watching a recording, noticing a change, naming it, acting by a policy."""
