/* What the board needs besides rtctl_board.h. */
#ifndef MPS2_AN386_H
#define MPS2_AN386_H

void mps2_start(void); /* once, before any other function of the board */

#endif
