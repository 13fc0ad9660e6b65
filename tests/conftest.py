"""What all tests share: Hypothesis without deadlines (kernels compile on their first call) and without chance."""

from hypothesis import settings

settings.register_profile("scantruss", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("scantruss")
