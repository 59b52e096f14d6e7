% Makes a model with the law as a block, to be copied into one's own; law_step.m and law_sfun.m must be on the path.
law_selftest();
new_system('law_model');
add_block('simulink/User-Defined Functions/Level-2 MATLAB S-Function', 'law_model/law', 'FunctionName', 'law_sfun');
open_system('law_model');
