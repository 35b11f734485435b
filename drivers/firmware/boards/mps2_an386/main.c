#include "mps2_an386.h"
#include "rtctl_device.h"

int main(void)
{
    mps2_start();
    device_start();
    for (;;)
        device_turn();
}
