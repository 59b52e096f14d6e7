/* cc -std=c99 -O2 law.c law_selftest.c -lm && ./a.out */
#include "law_selftest.h"

#include <stdio.h>

int main(void)
{
    const long wrong = law_selftest();
    if (wrong >= 0) {
        printf("law: sample %ld is not the expected one; do not run it\n", wrong);
        return 1;
    }
    printf("law: every sample is the expected one\n");
    return 0;
}
