"""The slider-crank mechanism: its kinematics, and what follows from them."""
