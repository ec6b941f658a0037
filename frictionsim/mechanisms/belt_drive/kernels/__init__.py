"""The compiled kernels of belts: layout of the state, contacts, signals and both kinematics."""
