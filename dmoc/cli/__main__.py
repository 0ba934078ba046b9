"""python -m dmoc.cli"""

from dmoc.cli import main

main()
