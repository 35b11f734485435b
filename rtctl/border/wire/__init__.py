"""What both ends of a wire share: registers, serial frames, the memory and clock of compiled exchanges."""
