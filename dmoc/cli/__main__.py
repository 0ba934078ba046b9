"""python -m dmoc.cli"""

from dmoc.cli.app import main

main()
