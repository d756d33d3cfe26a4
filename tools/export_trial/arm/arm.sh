# arm.sh MODEL REAL CPU(m4f|m7|m3) CSV [counts]
m=$1; r=$2; cpu=$3; csv=$4; shift 4; cd .; mkdir -p out; ./driver $m out $r $csv "$@" > /dev/null; n=$?
case $cpu in m4f) F="-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16"; M=mps2-an386;; m7) F="-mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-d16"; M=mps2-an500;; m3) F="-mcpu=cortex-m3 -mthumb"; M=mps2-an385;; esac
args=""; for i in $(seq 0 $((n-1))); do args="$args, (joint_real)((float)(k % 16U) * 1e-4f)"; done
cd out; sed "s|STEP|sink = joint_step(\&state$args).value; (void)sink;|g" ../arm/bench.c > bench.c
arm-none-eabi-gcc $F -std=c99 -O2 -pedantic -Wall -Wextra -Wconversion -Wdouble-promotion -Werror -ffreestanding -fstack-usage -c joint.c -o joint_arm.o || exit 1
echo "undefined: $(arm-none-eabi-nm -u joint_arm.o | tr '\n' ' ')"; arm-none-eabi-size joint_arm.o | tail -1; sort -k2 -n -t$'\t' joint_arm.su 2>/dev/null | tail -2
arm-none-eabi-gcc $F -std=gnu99 -O2 -ffreestanding -DJOINT_SELF_TEST -I. joint.c bench.c ../arm/start.c -T ../arm/link.ld -nostartfiles --specs=nosys.specs -o t.elf 2>&1 | grep -v warning | head -5
timeout 100 qemu-system-arm -M $M -nographic -semihosting -icount shift=0 -kernel t.elf; echo "exit $?"
