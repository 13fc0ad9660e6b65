"""How the program runs: compiling, storing machine code, threads, memory and clusters."""
