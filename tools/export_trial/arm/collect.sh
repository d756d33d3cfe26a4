for f in "lc te.csv" "linear te.csv" "polynomial te.csv" "maxwell_slip te.csv" "prandtl_ishlinskii te.csv" "viscoelastic te.csv" "hammerstein_wiener te.csv" "mlp te.csv" "grey_box te.csv" "res te.csv" "ex te.csv" "hb ht.csv" "hgrey_box ht.csv" "hgru ht.csv" "hlstm ht.csv" "parametric_gp te.csv"; do set -- $f
out=$(bash arm/arm.sh $1.safetensors float m4f $2 2>&1); t=$(echo "$out" | awk '/joint_arm.o/{print $1}'); i=$(echo "$out" | awk '/instructions/{print $NF*40/2000}')
tb=$(./driver $1.safetensors out float $2 2>/dev/null | grep -oE "tables [0-9]+" | awk '{print $2}')
ch=$(awk '/^typedef struct/{f=1} f' out/joint.c | sed -n '/^static const/,/};/!p' | sed '/_SELF_TEST/,$d' | sed 's|/\*.*\*/||' | tr -d ' \n' | wc -c)
echo "$1 text $t tables $tb code $((t-tb)) chars $ch ratio $(echo "scale=4; ($t-$tb)/$ch" | bc) instr $i"; done
