"""What moves a body: kinematics, skinning, inverse kinematics, collisions, URDF."""
