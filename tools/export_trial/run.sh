# run.sh MODEL REAL CSV [counts...]
cd .; m=$1; r=$2; csv=$3; shift 3; mkdir -p out; rm -f out/joint.o out/t; ./driver $m out $r $csv "$@"; n=$?; [ $n -ge 90 ] && exit 1
args=""; for i in $(seq 0 $((n-1))); do args="$args, (T$i)in[$i]"; done
T=""; i=0; for t in $(grep -oE "joint_step\(joint_state \*state.*\);" out/joint.h | head -1 | sed 's/.*\*state//; s/);//' | tr ',' '\n' | awk 'NF{print $1}'); do [ "$t" = "joint_real" ] && t=$r; T="$T -DT$i=$t"; i=$((i+1)); done
Z=$(grep -oE "void joint_set_zero_[a-zA-Z0-9_]+" out/joint.h | awk '{print $2"(\\&s, 0);"}' | tr '\n' ' ')
cp main.c out/; cd out; sed -i "s|ZEROS|$Z|; s|CALL;|joint_step(\&s$args);|; /#ifndef CALL/,/#endif/d" main.c
cc=${CC:-gcc}; $cc -std=c99 -O2 -pedantic -Wall -Wextra -Wconversion -Wdouble-promotion -Werror -ffreestanding -ffp-contract=off -c joint.c -o joint.o 2>&1 | head -${L:-12} && nm -u joint.o; gcc -O2 -std=gnu99 -w -DN=$n $T main.c joint.o -lm -o t && ./t
TOL=1e-6; [ $r = float ] && TOL=1e-4; gcc -std=c99 -O2 -I. -DJOINT_SELF_TEST -DTOL=$TOL -pedantic -Wall -Wextra -Wconversion -Wdouble-promotion -Werror -ffp-contract=off joint.c ../st.c -o st && ./st; echo rc $?
