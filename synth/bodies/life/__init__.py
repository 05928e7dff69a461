"""How people hold themselves in recorded life: distributions of joint angles, and how many poses draws come near."""
