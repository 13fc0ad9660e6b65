"""What all tests share: Hypothesis without deadlines (kernels compile on their first call) and without chance.

A shell has what it starts in the background ignore interrupts, and so does all that this starts in turn; the tests that
interrupt a run would then wait for it to its end, and fail.
"""

import signal

from hypothesis import settings

settings.register_profile("scantruss", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("scantruss")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
